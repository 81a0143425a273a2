//! Files, read and written whole: an output appears under its name complete, or not at all (DESIGN §5).

use std::io::Write as _;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::{Error, Result};

/// Reads a file of at most `max_bytes`; anything else is refused before a byte of it is read.
///
/// # Errors
/// [`Error::NoSuchFile`], [`Error::NotAFile`] (a folder, a pipe, a device), [`Error::FileTooLong`], or [`Error::Read`].
pub fn read_whole(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let failed = |cause: std::io::Error| match cause.kind() {
        std::io::ErrorKind::NotFound => Error::NoSuchFile { path: path.to_owned() },
        _ => Error::Read { path: path.to_owned(), cause },
    };
    let about = std::fs::metadata(path).map_err(failed)?;
    if !about.is_file() {
        return Err(Error::NotAFile {
            path: path.to_owned(),
            found: if about.is_dir() { "a folder" } else { "a device or a pipe" },
        });
    }
    if about.len() > max_bytes {
        let mb = |bytes: u64| bytes.div_ceil(1_000_000);
        return Err(Error::FileTooLong { path: path.to_owned(), found_mb: mb(about.len()), limit_mb: mb(max_bytes) });
    }
    std::fs::read(path).map_err(failed)
}

/// Writes one file through [`write_all`].
///
/// # Errors
/// [`Error::Write`] when the folder is missing or not writable, or the disk is full.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_all(&[(path.to_owned(), bytes.to_owned())])
}

/// Writes a set of files that belong together. Each goes to a temporary name beside its target and is flushed to disk; only when all of
/// them are there are they renamed, so that a killed run or a full disk leaves every old file or every new one whole, never half of one.
///
/// # Errors
/// [`Error::Write`] names the first file that could not be written; the temporary files are removed.
pub fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<()> {
    let staged: Vec<NamedTempFile> = files.iter().map(|(path, bytes)| stage(path, bytes)).collect::<Result<_>>()?;
    for (file, (path, _)) in staged.into_iter().zip(files) {
        file.persist(path).map_err(|e| Error::Write { path: path.clone(), cause: e.error })?;
    }
    Ok(())
}

fn stage(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let failed = |cause| Error::Write { path: path.to_owned(), cause };
    let mut file = temporary_in(path.parent().unwrap_or(Path::new(""))).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    Ok(file)
}

fn temporary_in(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sphereboard-").suffix(".part");
    // A temporary file is private by default; an output has the permissions that any new file of this user would have.
    #[cfg(unix)]
    builder.permissions(<std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
}

/// Makes `folder` where it is missing and checks that files can be created in it, before any work is spent on what goes there.
///
/// # Errors
/// [`Error::Write`] naming the folder.
pub fn ready_folder(folder: &Path) -> Result<()> {
    let made = std::fs::create_dir_all(folder).and_then(|()| temporary_in(folder));
    made.map(drop).map_err(|cause| Error::Write { path: folder.to_owned(), cause })
}

/// The folder of the shared photographs, meshes and papers: `SPHEREBOARD_SHARED`, else `../shared` beside the checkout; `None`
/// when it is not there.
pub fn shared_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("SPHEREBOARD_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    folder.is_dir().then_some(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_files_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let (good, bad) = (folder.path().join("a.json"), folder.path().join("missing/b.glb"));
        let error = write_all(&[(good.clone(), b"a".to_vec()), (bad, b"b".to_vec())]).unwrap_err();
        assert!(error.to_string().contains("b.glb"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
        write_all(&[(good.clone(), b"a".to_vec())]).unwrap();
        assert_eq!(std::fs::read(good).unwrap(), b"a");
    }
}
