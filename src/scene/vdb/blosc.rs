//! Unpacks what C-Blosc 1 packed: blocks of bytes, shuffled so that like bytes of numbers stand together, in LZ4 or zlib
//! (C-Blosc 1.21, its file `README_CHUNK_FORMAT.rst`).

use std::io::Read;

use flate2::read::ZlibDecoder;

const HEAD: usize = 16;
const SHUFFLED: u8 = 1;
const STORED: u8 = 2;
const BIT_SHUFFLED: u8 = 4;
const NOT_SPLIT: u8 = 16;
/// Sizes of a number, in bytes, beyond which a block is not split into streams.
const MOST_STREAMS: usize = 16;
/// Bytes of a stream below which a block is not split.
const LEAST_STREAM: usize = 128;
/// LZ4 and zlib cannot pack more bytes than so many into one (zlib: 1032); with it a head cannot ask for all memory.
const LARGEST_RATIO: usize = 1100;

/// Unpacks one buffer into `wanted` bytes. The error says what is wrong with it.
pub(super) fn unpack(packed: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    if packed.len() < HEAD {
        return Err(format!("{} bytes are too few for the head of a Blosc buffer", packed.len()));
    }
    let (flags, number) = (packed[2], usize::from(packed[3]).max(1));
    let count = word(packed, 4)?;
    let block = word(packed, 8)?;
    if count != wanted {
        return Err(format!("a Blosc buffer holds {count} bytes, {wanted} are needed"));
    }
    if word(packed, 12)? != packed.len() {
        return Err(format!("a Blosc buffer of {} bytes says that it has {}", packed.len(), word(packed, 12)?));
    }
    if flags & STORED != 0 {
        let stored = &packed[HEAD..];
        return if stored.len() == count { Ok(stored.to_vec()) } else { Err("a Blosc buffer is cut".to_owned()) };
    }
    if flags & BIT_SHUFFLED != 0 {
        return Err("Blosc's bit shuffle is not supported; byte shuffle is".to_owned());
    }
    if count > packed.len().saturating_mul(LARGEST_RATIO) || (block == 0 && count > 0) {
        return Err(format!("a Blosc buffer of {} bytes cannot hold {count} in blocks of {block}", packed.len()));
    }
    let mut all = Vec::with_capacity(count);
    for index in 0..count.div_ceil(block.max(1)) {
        let size = block.min(count - all.len());
        // The last block, if it is shorter than the others, is one stream.
        let whole = size == block;
        let split = flags & NOT_SPLIT == 0 && number <= MOST_STREAMS && size / number >= LEAST_STREAM && whole;
        let streams = if split { number } else { 1 };
        let mut at = word(packed, HEAD + 4 * index)?;
        let mut bytes = Vec::with_capacity(size);
        for stream in 0..streams {
            // What a number's size does not divide is in the last stream.
            let length = if stream + 1 == streams { size - bytes.len() } else { size / streams };
            let here = word(packed, at)?;
            let data = at.checked_add(4).and_then(|first| packed.get(first..first.checked_add(here)?));
            let data = data.ok_or("a stream of a Blosc buffer is cut")?;
            at += 4 + here;
            if here == length {
                bytes.extend_from_slice(data);
            } else {
                stream_of(data, flags >> 5, length, &mut bytes)?;
            }
        }
        if flags & SHUFFLED != 0 && number > 1 { unshuffle(&bytes, number, &mut all) } else { all.extend(bytes) }
    }
    Ok(all)
}

/// A little-endian word.
fn word(packed: &[u8], at: usize) -> Result<usize, String> {
    let bytes = at.checked_add(4).and_then(|end| packed.get(at..end)).ok_or("a Blosc buffer is cut")?;
    Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize)
}

/// Appends the bytes of one stream.
fn stream_of(data: &[u8], codec: u8, length: usize, bytes: &mut Vec<u8>) -> Result<(), String> {
    let first = bytes.len();
    let count = match codec {
        1 => {
            bytes.resize(first + length, 0);
            lz4_flex::block::decompress_into(data, &mut bytes[first..]).map_err(|error| format!("LZ4: {error}"))?
        }
        3 => {
            let mut unpacked = ZlibDecoder::new(data).take(length as u64 + 1);
            unpacked.read_to_end(bytes).map_err(|error| format!("zlib: {error}"))?
        }
        _ => {
            let names = ["BloscLZ", "", "Snappy", "", "Zstandard"];
            let name = names.get(usize::from(codec)).copied().unwrap_or("an unknown one");
            return Err(format!("Blosc's codec {codec} ({name}) is not supported; LZ4 and zlib are"));
        }
    };
    if count == length { Ok(()) } else { Err(format!("a stream has {count} bytes, {length} are needed")) }
}

/// Appends numbers of which all first bytes came first, then all second bytes, and so on.
fn unshuffle(bytes: &[u8], number: usize, all: &mut Vec<u8>) {
    let count = bytes.len() / number;
    all.extend((0..count).flat_map(|index| (0..number).map(move |k| bytes[k * count + index])));
    all.extend_from_slice(&bytes[count * number..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn buffer(flags: u8, number: u8, count: u32, block: u32, rest: &[u8]) -> Vec<u8> {
        let mut bytes = vec![2, 1, flags, number];
        [count, block, 16 + rest.len() as u32].iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        bytes.extend(rest);
        bytes
    }

    #[test]
    fn blocks_are_unpacked_and_their_bytes_sorted() {
        assert_eq!(unpack(&buffer(STORED, 4, 3, 3, b"abc"), 3).unwrap(), b"abc");
        // One block of two shuffled numbers of three bytes and one byte that is left over, as literals of LZ4.
        let literals = [&[0x70][..], b"adbecfX"].concat();
        let stream = |data: &[u8]| [&20u32.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), data].concat();
        let packed = buffer(SHUFFLED | NOT_SPLIT | 1 << 5, 3, 7, 7, &stream(&literals));
        assert_eq!(unpack(&packed, 7).unwrap(), b"abcdefX");
        let refused = |packed: &[u8], wanted| unpack(packed, wanted).expect_err("it is wrong");
        assert!(refused(&buffer(SHUFFLED | 1 << 5, 3, 7, 7, &stream(b"\xf0ad")), 7).contains("LZ4"));
        assert!(refused(&packed, 8).contains("holds 7 bytes, 8 are needed"));
        assert!(refused(&packed[..20], 7).contains("of 20 bytes says"));
        assert!(refused(&buffer(4 << 5, 3, 7, 7, &stream(&literals)), 7).contains("Zstandard"));
        assert!(refused(&buffer(BIT_SHUFFLED, 3, 7, 7, &stream(&literals)), 7).contains("bit shuffle"));
        assert!(refused(&buffer(1 << 5, 3, u32::MAX, 7, &[]), u32::MAX as usize).contains("cannot hold"));
        assert!(refused(&buffer(1 << 5, 3, 7, 7, &200u32.to_le_bytes()), 7).contains("cut"));
    }
}
