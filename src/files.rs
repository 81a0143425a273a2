//! Files, read and written whole: an output appears under its name complete, or not at all (DESIGN §5).

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

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
    put_in_place(stage_all(files)?)
}

/// A file that is whole under its temporary name, and the name it is meant for.
type Staged<'a> = (NamedTempFile, &'a Path);

fn stage_all(files: &[(PathBuf, Vec<u8>)]) -> Result<Vec<Staged<'_>>> {
    files.iter().map(|(path, bytes)| Ok((stage(path, bytes)?, path.as_path()))).collect()
}

fn put_in_place(staged: Vec<Staged>) -> Result<()> {
    staged.into_iter().try_for_each(|(file, path)| {
        file.persist(path).map(drop).map_err(|e| Error::Write { path: path.to_owned(), cause: e.error })
    })
}

fn stage(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let failed = |cause| Error::Write { path: path.to_owned(), cause };
    let mut file = temporary_in(path.parent().unwrap_or(Path::new(""))).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    Ok(file)
}

/// How our temporary files are named.
const TEMPORARY: (&str, &str) = (".sphereboard-", ".part");

/// A temporary file of this age belongs to no living run: no photograph takes nearly as long.
const ABANDONED: Duration = Duration::from_secs(3600);

fn temporary_in(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1);
    // A temporary file is private by default; an output has the permissions that any new file of this user would have.
    #[cfg(unix)]
    builder.permissions(<std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
}

/// Removes what killed runs left behind: our temporary files that nobody has written to for an hour. What cannot be removed stays.
fn sweep(folder: &Path) {
    let ours = |name: &str| name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let abandoned = entry.file_name().to_str().is_some_and(ours)
            && entry.metadata().is_ok_and(|about| {
                about.is_file() && about.modified().ok().and_then(|time| time.elapsed().ok()).is_some_and(|age| age > ABANDONED)
            });
        if abandoned {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// A folder that results can go to. When dropped, the folders that were made for it go again, unless something came into them.
#[derive(Debug)]
#[must_use = "dropping it removes the folder while it is empty"]
pub struct ReadyFolder {
    /// What was made, deepest first.
    made: Vec<PathBuf>,
}

impl Drop for ReadyFolder {
    fn drop(&mut self) {
        for folder in &self.made {
            // Refused by the system, as it should be, unless the folder is empty.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// Makes `folder` where it is missing and checks that files can be created in it, before any work is spent on what goes there. Removes
/// temporary files that killed runs left in it more than an hour ago.
///
/// # Errors
/// [`Error::NotAFolder`], or [`Error::Write`] naming the folder.
pub fn ready_folder(folder: &Path) -> Result<ReadyFolder> {
    if folder.is_file() {
        return Err(Error::NotAFolder { path: folder.to_owned() });
    }
    let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let ready = ReadyFolder { made: folder.ancestors().take_while(missing).map(Path::to_owned).collect() };
    let made = std::fs::create_dir_all(folder).and_then(|()| temporary_in(folder));
    made.map_err(|cause| Error::Write { path: folder.to_owned(), cause })?;
    sweep(folder);
    Ok(ready)
}

/// Removes the files of a folder whose names begin and end so, with digits between: what an earlier run left there.
///
/// # Errors
/// [`Error::Write`] for one that cannot be removed.
pub fn remove_numbered(folder: &Path, begin: &str, end: &str) -> Result<()> {
    let is_one = |name: &str| {
        let number = name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
        number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let failed = |cause| Error::Write { path: folder.to_owned(), cause };
    let mut old =
        std::fs::read_dir(folder).map_err(failed)?.flatten().filter(|entry| entry.file_name().to_str().is_some_and(is_one));
    old.try_for_each(|entry| std::fs::remove_file(entry.path())).map_err(failed)
}

/// Refuses results that would replace an input, under whichever name or link it was given.
///
/// # Errors
/// [`Error::OverwritesInput`] naming the first such input.
pub fn refuse_overwriting<'a>(outputs: impl IntoIterator<Item = &'a Path>, inputs: &[PathBuf]) -> Result<()> {
    // What does not exist has no canonical name, but cannot be an input either.
    let whole = |path: &Path| std::fs::canonicalize(path).ok();
    let inputs: BTreeMap<PathBuf, &PathBuf> = inputs.iter().filter_map(|input| Some((whole(input)?, input))).collect();
    match outputs.into_iter().filter_map(whole).find_map(|output| inputs.get(&output).copied()) {
        Some(input) => Err(Error::OverwritesInput { input: input.clone() }),
        None => Ok(()),
    }
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
    fn only_the_numbered_files_of_a_folder_go() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["frame_00012.png", "frame_1.png", "frame_.png", "frame_a.png", "frame_3.jpg", "my_frame_3.png"];
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), b"").unwrap());
        remove_numbered(folder.path(), "frame_", ".png").unwrap();
        let left: Vec<bool> = names.iter().map(|name| folder.path().join(name).exists()).collect();
        assert_eq!(left, [false, false, true, true, true, true]);
    }

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

    /// The moment at which a killed run does the most harm: everything is staged, nothing renamed.
    #[test]
    fn between_staging_and_renaming_the_old_files_are_untouched() {
        let folder = tempfile::tempdir().unwrap();
        let files = ["a.json", "b.glb"].map(|name| (folder.path().join(name), b"new".to_vec()));
        files.iter().for_each(|(path, _)| std::fs::write(path, b"old").unwrap());
        let read = || files.each_ref().map(|(path, _)| std::fs::read(path).unwrap());
        let staged = stage_all(&files).unwrap();
        assert_eq!(read(), [b"old", b"old"]);
        assert!(staged.iter().all(|(file, _)| std::fs::read(file.path()).unwrap() == b"new"), "the new files wait, whole");
        drop(staged);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left behind");
        // A second name keeps the old file where the new one takes its place, and shows it where it is written over.
        let second = folder.path().join("second name");
        std::fs::hard_link(&files[1].0, &second).unwrap();
        put_in_place(stage_all(&files).unwrap()).unwrap();
        assert_eq!(read(), [b"new", b"new"]);
        assert_eq!(std::fs::read(second).unwrap(), b"old", "the file was written over");
    }

    #[test]
    fn only_our_own_old_temporary_files_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let day_ago = std::time::SystemTime::now() - Duration::from_secs(86_400);
        for (name, old) in
            [(".sphereboard-a.part", true), (".sphereboard-b.part", false), (".sphereboard-c.txt", true), ("d.part", true)]
        {
            let file = std::fs::File::create(folder.path().join(name)).unwrap();
            if old {
                file.set_modified(day_ago).unwrap();
            }
        }
        drop(ready_folder(folder.path()).unwrap());
        let mut left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, [".sphereboard-b.part", ".sphereboard-c.txt", "d.part"]);
    }

    #[test]
    fn a_folder_made_in_vain_goes_again() {
        let place = tempfile::tempdir().unwrap();
        let deep = place.path().join("a/b");
        drop(ready_folder(&deep).unwrap());
        assert!(!place.path().join("a").exists());
        let ready = ready_folder(&deep).unwrap();
        write_whole(&deep.join("c"), b"c").unwrap();
        drop(ready);
        assert!(deep.join("c").exists());
        std::fs::remove_file(deep.join("c")).unwrap();
        drop(ready_folder(&deep).unwrap());
        assert!(deep.exists(), "it was there before");
    }

    #[test]
    fn an_input_is_found_under_any_of_its_names() {
        let place = tempfile::tempdir().unwrap();
        let mask = place.path().join("oak.mask.png");
        std::fs::write(&mask, b"white").unwrap();
        let roundabout = place.path().join(".").join("oak.mask.png");
        let refused = refuse_overwriting([place.path().join("oak.json").as_path(), &roundabout], std::slice::from_ref(&mask));
        assert!(matches!(refused, Err(Error::OverwritesInput { input }) if input == mask));
        assert!(refuse_overwriting([place.path().join("oak.json").as_path()], &[mask]).is_ok());
    }
}
