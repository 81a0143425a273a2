//! Files, read and written whole: an output appears under its name complete, or not at all (DESIGN §5).

use std::io::Write as _;
use std::path::{Path, PathBuf};

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

/// Writes `bytes` to a temporary name beside `path`, flushes it to disk and renames it, so that a killed run leaves the old file or
/// the new one, never half of either.
///
/// # Errors
/// [`Error::Write`] when the folder is missing or not writable, or the disk is full; the temporary file is removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let failed = |cause| Error::Write { path: path.to_owned(), cause };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::Builder::new().prefix(".sphereboard-").suffix(".part").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    // A temporary file is private; an output has the permissions any new file of this user would have.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(failed)?;
    }
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// The folder of the shared photographs, meshes and papers: `SPHEREBOARD_SHARED`, else `../shared` beside the checkout; `None`
/// when it is not there.
pub fn shared_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("SPHEREBOARD_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    folder.is_dir().then_some(folder)
}
