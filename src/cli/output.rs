//! Output files, which are written completely or not at all.

use brdfit::Error;
use brdfit::error::Place;
pub use brdfit::report::json;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file to be written. It is opened before the long work, so that a path that cannot be written is reported at
/// once, and put in place after it.
pub enum Output {
    /// A regular file, written to a temporary file beside it that then replaces it.
    Whole(NamedTempFile, PathBuf),
    /// A device or a pipe, which cannot be replaced.
    Direct(File, PathBuf),
}

impl Output {
    /// Prepares to write to `path`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let special = fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir());
        if special {
            let file = File::options().write(true).open(path).map_err(Error::write(path))?;
            return Ok(Self::Direct(file, path.to_owned()));
        }
        if path.is_dir() {
            return Err(Error::malformed(path, Place::File, "a file to write", "a folder"));
        }
        // Where it does mean standard output it never comes here.
        if path == Path::new("-") {
            let expected = "a file to write (standard output is /dev/stdout)";
            return Err(Error::malformed(path, Place::File, expected, "-"));
        }
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".brdfit-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // The permissions of any new file; the user's umask still applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let temporary = builder.tempfile_in(folder).map_err(Error::write(path))?;
        Ok(Self::Whole(temporary, path.to_owned()))
    }

    /// Writes everything and puts the file in place.
    pub fn commit(self, bytes: &[u8]) -> Result<(), Error> {
        match self {
            Self::Direct(mut file, path) => {
                match file.write_all(bytes).and_then(|()| file.flush()) {
                    // A reader that closes the pipe early is not an error.
                    Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                        Err(Error::write(&path)(error))
                    }
                    _ => Ok(()),
                }
            }
            Self::Whole(mut file, path) => {
                file.write_all(bytes).map_err(Error::write(&path))?;
                file.persist(&path).map_err(|e| Error::write(&path)(e.error))?;
                Ok(())
            }
        }
    }
}

/// Fails if `output` would replace one of the `inputs`. The error names `option`, which set the output.
pub fn spares(inputs: &[PathBuf], option: &str, output: Option<&Path>) -> Result<(), Error> {
    let output = output.and_then(|path| path.canonicalize().ok()).filter(|path| path.is_file());
    let same = |input: &&PathBuf| output.is_some() && input.canonicalize().ok() == output;
    inputs.iter().find(same).map_or(Ok(()), |input| {
        let subject = format!("{option} {}", input.display());
        Err(Error::invalid(subject, "a file other than the input", "the input"))
    })
}
