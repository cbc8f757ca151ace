//! Little-endian numbers of a file, each of them checked against the file's end.

use std::fmt::Display;

/// Bytes, and where they are from.
#[derive(Clone)]
pub(super) struct Bytes<'a> {
    data: &'a [u8],
    /// Where they begin in what `of` names.
    first: usize,
    /// What offsets in messages count in, after the number: nothing stands for the file itself.
    of: String,
}

impl<'a> Bytes<'a> {
    /// A whole file.
    pub fn of_file(data: &'a [u8]) -> Self {
        Bytes { data, first: 0, of: String::new() }
    }

    /// What was unpacked from a file.
    pub fn unpacked(data: &'a [u8], name: &str) -> Self {
        Bytes { data, first: 0, of: format!(" of the unpacked grid {name:?}") }
    }

    /// Some of the bytes, whose offsets begin with 0 again; messages still count from where these begin.
    pub fn part(&self, at: usize, count: usize) -> Result<Self, String> {
        Ok(Bytes { data: self.slice(at, count)?, first: self.first + at, of: self.of.clone() })
    }

    pub fn len(&self) -> usize {
        self.data.len()
    }

    /// A message about what is at an offset.
    pub fn error(&self, at: usize, cause: impl Display) -> String {
        format!("byte {}{}: {cause}", self.first as u64 + at as u64, self.of)
    }

    /// `base` + `offset`, which lies within the bytes.
    pub fn moved(&self, base: usize, offset: i64) -> Result<usize, String> {
        let sum = i64::try_from(base).ok().and_then(|base| base.checked_add(offset));
        let inside = sum.and_then(|sum| usize::try_from(sum).ok()).filter(|sum| *sum < self.len());
        inside.ok_or_else(|| self.error(base, format!("an offset of {offset} bytes leads out of the grid")))
    }

    /// So many bytes.
    pub fn slice(&self, at: usize, count: usize) -> Result<&'a [u8], String> {
        let end = at.checked_add(count).filter(|end| *end <= self.len());
        let end = end.ok_or_else(|| {
            let last = self.first as u64 + self.len() as u64;
            self.error(at, format!("{count} bytes are needed here, but it ends at byte {last}"))
        })?;
        Ok(&self.data[at..end])
    }

    fn array<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.slice(at, N)?);
        Ok(array)
    }

    pub fn u16(&self, at: usize) -> Result<u16, String> {
        self.array(at).map(u16::from_le_bytes)
    }

    pub fn u32(&self, at: usize) -> Result<u32, String> {
        self.array(at).map(u32::from_le_bytes)
    }

    pub fn u64(&self, at: usize) -> Result<u64, String> {
        self.array(at).map(u64::from_le_bytes)
    }

    pub fn i64(&self, at: usize) -> Result<i64, String> {
        self.array(at).map(i64::from_le_bytes)
    }

    pub fn f32(&self, at: usize) -> Result<f32, String> {
        self.array(at).map(f32::from_le_bytes)
    }

    pub fn f64(&self, at: usize) -> Result<f64, String> {
        self.array(at).map(f64::from_le_bytes)
    }

    /// A number of bytes or an offset, which a machine of 32 bits may not be able to hold.
    pub fn size(&self, at: usize) -> Result<usize, String> {
        let size = self.u64(at)?;
        usize::try_from(size).map_err(|_| self.error(at, format!("{size} bytes are too many")))
    }
}

/// Bytes that are read one after the other.
pub(super) struct Cursor<'a> {
    pub bytes: Bytes<'a>,
    pub at: usize,
}

impl<'a> Cursor<'a> {
    /// A message about what was read last or comes next.
    pub fn error(&self, cause: impl Display) -> String {
        self.bytes.error(self.at, cause)
    }

    pub fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let slice = self.bytes.slice(self.at, count)?;
        self.at += count;
        Ok(slice)
    }

    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let array = self.bytes.array(self.at)?;
        self.at += N;
        Ok(array)
    }

    pub fn u8(&mut self) -> Result<u8, String> {
        self.array().map(u8::from_le_bytes)
    }

    pub fn u32(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn i32(&mut self) -> Result<i32, String> {
        self.array().map(i32::from_le_bytes)
    }

    pub fn i64(&mut self) -> Result<i64, String> {
        self.array().map(i64::from_le_bytes)
    }

    /// Numbers in double precision.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.array().map(f64::from_le_bytes)?;
        }
        Ok(numbers)
    }

    /// Three integers.
    pub fn place(&mut self) -> Result<[i32; 3], String> {
        Ok([self.i32()?, self.i32()?, self.i32()?])
    }

    /// A text with its length before it.
    pub fn text(&mut self) -> Result<String, String> {
        let count = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(count)?).into_owned())
    }
}
