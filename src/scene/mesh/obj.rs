//! Wavefront OBJ files: positions, normals, texture coordinates and polygons. Everything else of the format is checked
//! for form, and dropped.
//!
//! This is a reader of our own since a mesh decides what is inside a medium, so whatever is odd in a file must be an
//! error with its line; `tobj`, with which it is compared in the tests, has no line numbers, makes triangles of
//! polylines (`l`), divides positions by a fourth coordinate and passes NaN on.

use glam::{DVec2, DVec3};

use crate::scene::Mesh;

/// A mesh as it is in the file.
#[derive(Clone, Debug)]
pub struct Obj {
    /// Vertices that faces use, and triangles. A position with several normals or texture coordinates is several vertices.
    /// Normals are unit vectors, or zero where the file has none for a vertex; the list is empty if it has none at all, and so
    /// is the one of texture coordinates, which are as in the file: (0, 0) is the lower left of an image.
    pub mesh: Mesh,
    /// The file has normals of vertices.
    pub has_normals: bool,
    /// Vertices without texture coordinates in a file in which others have some; theirs are (0, 0).
    pub missing_uvs: usize,
}

/// What is wrong in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjError {
    /// Line, from 1.
    pub line: u32,
    /// Column in bytes, from 1.
    pub col: u32,
    /// What is wrong, and what is accepted instead.
    pub message: String,
}

/// Statements without a meaning for the shape: groups, materials, points, lines, levels of detail.
const IGNORED: [&[u8]; 17] = [
    b"vp",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"p",
    b"l",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
];

/// Reads a file. Polygons become fans around their first corner. Indices may be negative, counting back from the latest
/// vertex, and must be of vertices that stand further up in the file.
pub fn parse(bytes: &[u8]) -> Result<Obj, ObjError> {
    let mut reader = Reader::default();
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        reader.line(line).map_err(|(col, message)| ObjError {
            line: u32::try_from(index + 1).unwrap_or(u32::MAX),
            col: u32::try_from(col + 1).unwrap_or(u32::MAX),
            message,
        })?;
    }
    Ok(reader.finish())
}

/// A message and the offset in the line that it is about.
type LineError = (usize, String);

#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    uvs: Vec<DVec2>,
    normals: Vec<DVec3>,
    triangles: Vec<[Corner; 3]>,
    /// Corners of the face that is being read.
    polygon: Vec<Corner>,
}

/// Indices of a position, a texture coordinate and a normal.
type Corner = [u32; 3];

/// Stands for a texture coordinate or a normal that a corner does not have.
const NONE: u32 = u32::MAX;

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), LineError> {
        let mut tokens = Tokens { line, offset: 0 };
        let Some((start, keyword)) = tokens.next() else { return Ok(()) };
        match keyword {
            b"v" => self.position(start, tokens),
            b"f" => self.face(start, tokens),
            b"vn" => {
                let (n, _) = numbers(start, &mut tokens, 3, 3)?;
                let n = DVec3::new(n[0], n[1], n[2]);
                // Scaled first, so that the length neither overflows nor underflows.
                let n = (n / n.abs().max_element()).try_normalize().unwrap_or_default();
                push(&mut self.normals, n, start)
            }
            b"vt" => {
                let (uv, _) = numbers(start, &mut tokens, 1, 3)?;
                push(&mut self.uvs, DVec2::new(uv[0], uv[1]), start)
            }
            _ if keyword[0] == b'#' || IGNORED.contains(&keyword) => Ok(()),
            _ => {
                let keyword: String = String::from_utf8_lossy(keyword).chars().take(40).collect();
                Err((start, format!("\"{keyword}\" is not a statement of a polygon mesh in an OBJ file")))
            }
        }
    }

    /// `v x y z`, with an optional weight of 1 or an optional colour, which has no meaning here.
    fn position(&mut self, start: usize, mut tokens: Tokens) -> Result<(), LineError> {
        let (values, count) = numbers(start, &mut tokens, 3, 7)?;
        match count {
            4 if values[3] != 1.0 => {
                Err((start, format!("the weight of a vertex is {}; only 1 is supported", values[3])))
            }
            5 => {
                Err((start, "a vertex has 5 numbers; it must have 3, with a weight 4, or with a colour 6 or 7".into()))
            }
            _ => push(&mut self.positions, DVec3::new(values[0], values[1], values[2]), start),
        }
    }

    fn face(&mut self, start: usize, tokens: Tokens) -> Result<(), LineError> {
        self.polygon.clear();
        for (offset, token) in tokens {
            let corner = self.corner(token).map_err(|message| (offset, message))?;
            self.polygon.push(corner);
        }
        let &[first, _, _, ..] = &self.polygon[..] else {
            return Err((start, format!("a face has {} corners; it must have at least 3", self.polygon.len())));
        };
        self.triangles.extend(self.polygon[1..].windows(2).map(|pair| [first, pair[0], pair[1]]));
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, token: &[u8]) -> Result<Corner, String> {
        let mut parts = token.split(|byte| *byte == b'/');
        let mut corner = [index("vertex", parts.next().unwrap_or_default(), self.positions.len())?, NONE, NONE];
        for (k, what, count) in [(1, "texture coordinate", self.uvs.len()), (2, "normal", self.normals.len())] {
            match parts.next() {
                None | Some(b"") => {}
                Some(part) => corner[k] = index(what, part, count)?,
            }
        }
        if parts.next().is_some() {
            return Err(format!(
                "\"{}\" is not a corner; it must be of the form v, v/vt, v//vn or v/vt/vn",
                String::from_utf8_lossy(token)
            ));
        }
        Ok(corner)
    }

    /// Makes one vertex of each corner that differs from all others, and leaves out what no face uses.
    fn finish(self) -> Obj {
        /// The end of a chain.
        const END: u32 = u32::MAX;
        // The vertices made from one position are a chain: `first` of the position, then `next` of each vertex.
        let mut first = vec![END; self.positions.len()];
        let (mut next, mut corners) = (Vec::<u32>::new(), Vec::<Corner>::new());
        let mut vertex_of = |corner: Corner| {
            let mut link = first[corner[0] as usize];
            while link != END && corners[link as usize] != corner {
                link = next[link as usize];
            }
            if link == END {
                link = corners.len() as u32;
                corners.push(corner);
                next.push(std::mem::replace(&mut first[corner[0] as usize], link));
            }
            link
        };
        let triangles = self.triangles.iter().map(|triangle| triangle.map(&mut vertex_of)).collect();
        let missing = |k: usize| corners.iter().filter(|corner| corner[k] == NONE).count();
        let missing_uvs = if missing(1) == corners.len() { 0 } else { missing(1) };
        let column = |k: usize| corners.iter().map(move |corner| corner[k]);
        let mesh = Mesh {
            positions: column(0).map(|index| self.positions[index as usize]).collect(),
            normals: if missing(2) == corners.len() {
                Vec::new()
            } else {
                column(2).map(or_zero(&self.normals)).collect()
            },
            uvs: if missing(1) == corners.len() { Vec::new() } else { column(1).map(or_zero(&self.uvs)).collect() },
            triangles,
        };
        Obj { mesh, has_normals: !self.normals.is_empty(), missing_uvs }
    }
}

/// An entry of a list, or zero for [`NONE`].
fn or_zero<T: Copy + Default>(list: &[T]) -> impl Fn(u32) -> T {
    |index| list.get(index as usize).copied().unwrap_or_default()
}

/// Appends to a list whose indices must be below [`NONE`].
fn push<T>(list: &mut Vec<T>, value: T, start: usize) -> Result<(), LineError> {
    if list.len() == NONE as usize {
        return Err((start, "more vertices than 32 bits can count".into()));
    }
    list.push(value);
    Ok(())
}

/// An index into a list that has `count` entries so far, counted from 0.
fn index(what: &str, text: &[u8], count: usize) -> Result<u32, String> {
    let value = std::str::from_utf8(text).ok().and_then(|text| text.parse::<i64>().ok());
    let Some(value) = value else {
        return Err(format!("\"{}\" is not the index of a {what}", String::from_utf8_lossy(text)));
    };
    let from_start = if value < 0 { count as i64 + value } else { value - 1 };
    if value == 0 || from_start < 0 || from_start >= count as i64 {
        return Err(format!("there is no {what} {value}: the file has {count} of them up to here"));
    }
    // Lists are shorter than that.
    Ok(from_start as u32)
}

/// Finite numbers up to the end of the line, and how many there are.
fn numbers(start: usize, tokens: &mut Tokens, least: usize, most: usize) -> Result<([f64; 7], usize), LineError> {
    let mut values = [0.0; 7];
    let mut count = 0;
    for (offset, token) in tokens {
        if count == most {
            return Err((offset, format!("too many numbers; at most {most} are accepted")));
        }
        let text = || String::from_utf8_lossy(token);
        match std::str::from_utf8(token).ok().and_then(|text| text.parse::<f64>().ok()) {
            Some(value) if value.is_finite() => values[count] = value,
            Some(_) => return Err((offset, format!("\"{}\" is not a finite number", text()))),
            None => return Err((offset, format!("\"{}\" is not a number", text()))),
        }
        count += 1;
    }
    if count < least {
        return Err((start, format!("{count} numbers are given; at least {least} are needed")));
    }
    Ok((values, count))
}

/// The words of a line with their offsets, up to a comment.
struct Tokens<'a> {
    line: &'a [u8],
    offset: usize,
}

impl<'a> Iterator for Tokens<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = &self.line[self.offset..];
        let start = self.offset + rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let rest = &self.line[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.offset = start + length;
        if start > 0 && rest[0] == b'#' {
            self.offset = self.line.len();
            return None;
        }
        Some((start, &rest[..length]))
    }
}
