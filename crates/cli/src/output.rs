//! Where results go: a file that appears complete or not at all, or standard output.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

use crate::error::CliError;

/// An output that is visible only after [`Output::commit`].
pub struct Output {
    name: String,
    sink: Sink,
}

enum Sink {
    /// A regular file: written beside it, renamed at the end.
    File(BufWriter<AtomicWriteFile>),
    /// A device or a pipe, which cannot be renamed over.
    Device(BufWriter<File>),
    /// Standard output, held back until the end.
    Stdout(Vec<u8>),
}

impl Output {
    /// Prepares an output; `-` is standard output.
    ///
    /// # Errors
    /// A directory that does not exist or cannot be written to, or a path that is a directory.
    pub fn create(path: &Path) -> Result<Self, CliError> {
        if path == Path::new("-") {
            return Ok(Self {
                name: "standard output".to_owned(),
                sink: Sink::Stdout(Vec::new()),
            });
        }
        let name = path.display().to_string();
        if path.is_dir() {
            return Err(CliError::Usage(format!(
                "cannot write {name}: it is a directory"
            )));
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            let folder = folder.display();
            return Err(CliError::Usage(format!(
                "cannot write {name}: the directory {folder} does not exist"
            )));
        }
        let is_device = path.exists() && !path.is_file();
        let sink = if is_device {
            File::create(path).map(|file| Sink::Device(BufWriter::new(file)))
        } else {
            AtomicWriteFile::open(path).map(|file| Sink::File(BufWriter::new(file)))
        };
        Ok(Self {
            sink: sink.map_err(CliError::io("write", name.clone()))?,
            name,
        })
    }

    /// The output's name in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Makes everything written so far visible under the output's name.
    ///
    /// # Errors
    /// A system error; a file that was there before is then unchanged.
    pub fn commit(self) -> Result<(), CliError> {
        let committed = match self.sink {
            Sink::File(writer) => writer
                .into_inner()
                .map_err(io::IntoInnerError::into_error)
                .and_then(AtomicWriteFile::commit),
            Sink::Device(mut writer) => writer.flush(),
            Sink::Stdout(bytes) => {
                let mut stdout = io::stdout().lock();
                stdout.write_all(&bytes).and_then(|()| stdout.flush())
            }
        };
        committed.map_err(CliError::io("write", self.name))
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.sink {
            Sink::File(writer) => writer.write(bytes),
            Sink::Device(writer) => writer.write(bytes),
            Sink::Stdout(writer) => writer.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.sink {
            Sink::File(writer) => writer.flush(),
            Sink::Device(writer) => writer.flush(),
            Sink::Stdout(writer) => writer.flush(),
        }
    }
}

/// Refuses an output that is one of the inputs, under whatever name.
///
/// # Errors
/// The two paths lead to the same file.
pub fn check_not_an_input(output: &Path, inputs: &[&Path]) -> Result<(), CliError> {
    check_option_not_an_input("--output", output, inputs)
}

/// The same of an output that another option names.
///
/// # Errors
/// The two paths lead to the same file.
pub fn check_option_not_an_input(
    option: &str,
    output: &Path,
    inputs: &[&Path],
) -> Result<(), CliError> {
    let Ok(target) = output.canonicalize() else {
        return Ok(()); // it does not exist yet
    };
    let same = |input: &&&Path| input.canonicalize().is_ok_and(|input| input == target);
    match inputs.iter().find(same) {
        Some(input) if target.is_file() => {
            let (output, input) = (output.display(), input.display());
            Err(CliError::Usage(format!(
                "{option} {output} is the input {input}: it would be overwritten"
            )))
        }
        _ => Ok(()),
    }
}

/// Refuses two outputs, each with the option that names it, that are one file, under whatever names.
///
/// # Errors
/// Two paths lead to the same file, or would.
pub fn check_different(outputs: &[(&str, &Path)]) -> Result<(), CliError> {
    for (number, (option, path)) in outputs.iter().enumerate() {
        let before = outputs[..number].iter();
        let same = before
            .clone()
            .find(|(_, other)| place_of(other) == place_of(path));
        if let Some((other, _)) = same {
            let path = path.display();
            return Err(CliError::Usage(format!(
                "{other} and {option} are both {path}: one would overwrite the other"
            )));
        }
    }
    Ok(())
}

/// Where a path leads, whether there is a file or not.
fn place_of(path: &Path) -> PathBuf {
    let of_folder = || {
        let folder = folder_of(path).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    let of_file = path.canonicalize().ok();
    of_file
        .or_else(of_folder)
        .unwrap_or_else(|| path.to_owned())
}

/// The directory a path lies in.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}
