//! The files that a model file names: read from its own folder or one below, never from elsewhere.

use std::path::{Component, Path, PathBuf};

use data_url::DataUrl;
use percent_encoding::percent_decode_str;

use crate::files;

/// The longest file that a model may name.
const LONGEST_BYTES: u64 = 4 << 30;

/// Where the files lie that a model file names; `None` when it came as bytes, without a folder.
#[derive(Debug, Clone, Default)]
pub struct Folder(Option<PathBuf>);

impl Folder {
    /// The folder of the file at `path`.
    pub fn of(path: &Path) -> Self {
        let parent = path.parent().unwrap_or(Path::new(""));
        Self(Some(if parent.as_os_str().is_empty() { PathBuf::from(".") } else { parent.to_owned() }))
    }

    /// What a glTF URI stands for: the bytes inside a `data:` URI, or those of a file.
    ///
    /// # Errors
    /// Why it cannot be had, as the end of a sentence that begins with what was wanted.
    pub fn uri(&self, uri: &str) -> Result<Vec<u8>, String> {
        if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
            let data = DataUrl::process(uri).map_err(|e| format!("is {e}"))?;
            return data.decode_to_vec().map(|(bytes, _)| bytes).map_err(|_| "is no sound base64".to_owned());
        }
        if uri.contains("://") {
            return Err(format!("lies at {}, and nothing is fetched from the network", shortened(uri)));
        }
        self.file(&percent_decode_str(uri).decode_utf8_lossy())
    }

    /// The bytes of the file `name`, a path relative to the folder with either kind of slash.
    ///
    /// # Errors
    /// As [`Folder::uri`].
    pub fn file(&self, name: &str) -> Result<Vec<u8>, String> {
        let Some(folder) = &self.0 else {
            return Err(format!("is the file {}, which did not come along", shortened(name)));
        };
        let relative = PathBuf::from(name.replace('\\', "/"));
        let plain = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let outside = || format!("is {}, outside the model's own folder; put it beside the model", shortened(name));
        if name.is_empty() || !plain || name.contains(':') {
            return Err(outside());
        }
        let path = folder.join(relative);
        // A link may lead out of the folder.
        if let (Ok(whole), Ok(root)) = (path.canonicalize(), folder.canonicalize())
            && !whole.starts_with(root)
        {
            return Err(outside());
        }
        files::read_whole(&path, LONGEST_BYTES).map_err(|error| match error {
            crate::Error::NoSuchFile { .. } => format!("is the file {}, which is not there", shortened(name)),
            other => format!("cannot be had: {other}"),
        })
    }
}

/// A name that is fit for a message, whatever the file says.
pub fn shortened(name: &str) -> String {
    let mut text: String = name.chars().map(|c| if c.is_control() { '?' } else { c }).take(121).collect();
    if text.chars().count() > 120 {
        text = text.chars().take(117).chain("…".chars()).collect();
    }
    text
}
