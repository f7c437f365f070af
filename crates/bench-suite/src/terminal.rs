//! What the program says on standard output and standard error.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Standard output, where a reader who has seen enough, such as `head`, is no error.
pub struct Output(io::Stdout);

impl Output {
    /// Standard output.
    pub fn new() -> Self {
        Self(io::stdout())
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.0.write(bytes) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(bytes.len()),
            written => written,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self.0.flush() {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            flushed => flushed,
        }
    }
}

/// Says why the program stops; there is nobody to tell when that cannot be written.
pub fn error(text: impl Display) {
    drop(writeln!(io::stderr(), "error: {text}"));
}
