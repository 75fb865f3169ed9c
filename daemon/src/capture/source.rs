//! Where a capture's bytes come from: a file, or memory. Read at any offset, never past the end.

use std::fs::File;
use std::io;

/// Bytes that can be read at any offset.
pub trait ReadAt {
    /// Number of bytes.
    ///
    /// # Errors
    /// If the system cannot tell.
    fn size(&self) -> io::Result<u64>;

    /// Fills `buffer` from `offset`.
    ///
    /// # Errors
    /// If that many bytes are not there, or reading fails.
    fn read_exact_at(&self, buffer: &mut [u8], offset: u64) -> io::Result<()>;
}

impl ReadAt for File {
    fn size(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }

    fn read_exact_at(&self, buffer: &mut [u8], offset: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(self, buffer, offset)
    }
}

impl<T: AsRef<[u8]>> ReadAt for io::Cursor<T> {
    fn size(&self) -> io::Result<u64> {
        Ok(self.get_ref().as_ref().len() as u64)
    }

    fn read_exact_at(&self, buffer: &mut [u8], offset: u64) -> io::Result<()> {
        let bytes = self.get_ref().as_ref();
        let start = usize::try_from(offset).ok().filter(|&start| start <= bytes.len());
        match start.and_then(|start| bytes[start..].get(..buffer.len())) {
            Some(found) => {
                buffer.copy_from_slice(found);
                Ok(())
            }
            None => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }
}

/// A small window over a source, so that walking many little headers costs few reads.
#[derive(Debug)]
pub(super) struct Window<'a, S> {
    source: &'a S,
    size: u64,
    start: u64,
    bytes: Vec<u8>,
}

impl<'a, S: ReadAt> Window<'a, S> {
    const LEN: u64 = 4096;

    pub(super) fn new(source: &'a S) -> io::Result<Self> {
        Ok(Self { source, size: source.size()?, start: 0, bytes: Vec::new() })
    }

    pub(super) fn size(&self) -> u64 {
        self.size
    }

    /// The `N` bytes at `offset`; None where the source ends before.
    pub(super) fn array<const N: usize>(&mut self, offset: u64) -> io::Result<Option<[u8; N]>> {
        let Some(bytes) = self.bytes(offset, N)? else { return Ok(None) };
        Ok(bytes.first_chunk().copied())
    }

    /// The `len` bytes at `offset`; None where the source ends before. Callers bound `len`.
    pub(super) fn bytes(&mut self, offset: u64, len: usize) -> io::Result<Option<&[u8]>> {
        let Some(end) = offset.checked_add(len as u64).filter(|&end| end <= self.size) else {
            return Ok(None);
        };
        if offset < self.start || end > self.start + self.bytes.len() as u64 {
            let wanted = (len as u64).max(Self::LEN).min(self.size - offset);
            self.bytes.resize(usize::try_from(wanted).unwrap_or(len), 0);
            self.start = offset;
            if let Err(error) = self.source.read_exact_at(&mut self.bytes, offset) {
                self.bytes.clear();
                return Err(error);
            }
        }
        let from = usize::try_from(offset - self.start).unwrap_or(usize::MAX);
        Ok(self.bytes.get(from..).and_then(|rest| rest.get(..len)))
    }
}
