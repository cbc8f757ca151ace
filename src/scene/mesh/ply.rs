//! PLY files (Turk 1994), as text or binary in either byte order: positions, normals, texture coordinates and polygons. Other
//! elements and properties are read over.
//!
//! A reader of our own, since those on offer make a map of names to values of every vertex, which takes seconds and
//! gigabytes for a million triangles, and their errors do not say where in the file.

use glam::{DVec2, DVec3};

use super::{Attribute, FileMesh};
use crate::scene::Mesh;

/// Reads a file. Normals are `nx ny nz`, texture coordinates `u v`, `s t` or
/// `texture_u texture_v`, as in Mitsuba 3.9.1; polygons, which that
/// refuses, become fans around their first corner. The error says what is wrong, and in which line or at which byte.
pub fn parse(bytes: &[u8]) -> Result<FileMesh, String> {
    let header = Header::read(bytes)?;
    let mut body = Body { bytes, at: header.end, line: header.lines, format: header.format };
    let (mut mesh, mut normals, mut uvs) = (Mesh::default(), false, false);
    let mut attributes = Vec::new();
    let mut faces = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => (normals, uvs) = vertices(element, &mut body, &mut mesh, &mut attributes)?,
            "face" => {
                faces = true;
                polygons(element, &mut body, &mut mesh, &mut attributes)?;
            }
            _ => {
                for _ in 0..element.count {
                    skip(&element.properties, &mut body)?;
                }
            }
        }
    }
    if !faces {
        return Err("the file has no element \"face\"".to_owned());
    }
    // Faces may stand before the vertices.
    let count = mesh.positions.len();
    if let Some(index) = mesh.triangles.iter().flatten().find(|index| **index as usize >= count) {
        return Err(format!("a face names vertex {index}, but the file has {count} vertices, which count from 0"));
    }
    debug_assert_eq!((mesh.normals.is_empty(), mesh.uvs.is_empty()), (!normals || count == 0, !uvs || count == 0));
    Ok(FileMesh { mesh, attributes, missing_uvs: 0 })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn named(name: &str) -> Option<Type> {
        Some(match name {
            "char" | "int8" => Type::I8,
            "uchar" | "uint8" => Type::U8,
            "short" | "int16" => Type::I16,
            "ushort" | "uint16" => Type::U16,
            "int" | "int32" => Type::I32,
            "uint" | "uint32" => Type::U32,
            "float" | "float32" => Type::F32,
            "double" | "float64" => Type::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    /// Type of the number of items, if it is a list.
    list: Option<Type>,
    kind: Type,
}

struct ElementType {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

struct Header {
    format: Format,
    elements: Vec<ElementType>,
    /// Bytes and lines up to the first element.
    end: usize,
    lines: usize,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Header, String> {
        let mut header = Header { format: Format::Ascii, elements: Vec::new(), end: 0, lines: 0 };
        let mut format = None;
        loop {
            let rest = &bytes[header.end..];
            let Some(length) = rest.iter().position(|byte| *byte == b'\n') else {
                return Err("the header has no end_header; this is no PLY file".to_owned());
            };
            header.end += length + 1;
            header.lines += 1;
            let wrong = |what: &str| Err(format!("line {}: {what}", header.lines));
            let Ok(line) = std::str::from_utf8(&rest[..length]) else { return wrong("the header is not text") };
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                ["ply"] if header.lines == 1 => {}
                _ if header.lines == 1 => return wrong("the file does not start with \"ply\""),
                ["format", name, "1.0"] => {
                    format = match name {
                        "ascii" => Some(Format::Ascii),
                        "binary_little_endian" => Some(Format::Little),
                        "binary_big_endian" => Some(Format::Big),
                        _ => return wrong("the format must be ascii, binary_little_endian or binary_big_endian"),
                    }
                }
                ["format", ..] => return wrong("only version 1.0 of the format is known"),
                ["comment" | "obj_info", ..] | [] => {}
                ["element", name, count] => {
                    let Ok(count) = count.parse() else { return wrong("the number of elements is not a number") };
                    header.elements.push(ElementType { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", .., name] => {
                    let kinds: Option<Vec<Type>> = match words[1..words.len() - 1] {
                        [kind] => Type::named(kind).map(|kind| vec![kind]),
                        ["list", count, kind] => Type::named(count).zip(Type::named(kind)).map(|(a, b)| vec![a, b]),
                        _ => None,
                    };
                    let Some(kinds) = kinds else {
                        return wrong("a property is \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
                    };
                    let Some(element) = header.elements.last_mut() else {
                        return wrong("a property must follow an element");
                    };
                    let (list, kind) = match kinds[..] {
                        [count, kind] => (Some(count), kind),
                        _ => (None, kinds[0]),
                    };
                    if list.is_some_and(|count| matches!(count, Type::F32 | Type::F64)) {
                        return wrong("the length of a list must be a whole number");
                    }
                    element.properties.push(Property { name: name.to_owned(), list, kind });
                }
                ["end_header"] => break,
                _ => return wrong("unknown statement in the header"),
            }
        }
        header.format = format.ok_or("the header has no format")?;
        Ok(header)
    }
}

/// What follows the header.
struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line that `at` is in, from 0; of text only.
    line: usize,
    format: Format,
}

impl Body<'_> {
    fn error<T>(&self, what: &str) -> Result<T, String> {
        Err(match self.format {
            Format::Ascii => format!("line {}: {what}", self.line + 1),
            _ => format!("byte {}: {what}", self.at),
        })
    }

    fn number(&mut self, kind: Type) -> Result<f64, String> {
        if self.format == Format::Ascii {
            return self.word();
        }
        let Some(bytes) = self.bytes.get(self.at..self.at + kind.size()) else {
            return self.error("the file ends before its last element");
        };
        self.at += kind.size();
        let mut raw = [0; 8];
        // Little endian from here on.
        raw[..bytes.len()].copy_from_slice(bytes);
        if self.format == Format::Big {
            raw[..bytes.len()].reverse();
        }
        let [b0, b1, b2, b3, ..] = raw;
        let four = [b0, b1, b2, b3];
        Ok(match kind {
            Type::I8 => f64::from(i8::from_le_bytes([b0])),
            Type::U8 => f64::from(b0),
            Type::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Type::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Type::I32 => f64::from(i32::from_le_bytes(four)),
            Type::U32 => f64::from(u32::from_le_bytes(four)),
            Type::F32 => f64::from(f32::from_le_bytes(four)),
            Type::F64 => f64::from_le_bytes(raw),
        })
    }

    /// The next word of a text, as a number.
    fn word(&mut self) -> Result<f64, String> {
        while let Some(byte) = self.bytes.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return self.error("the file ends before its last element");
        }
        let word = &rest[..rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len())];
        self.at += word.len();
        match std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()) {
            Some(number) => Ok(number),
            None => {
                let word: String = String::from_utf8_lossy(word).chars().take(40).collect();
                self.error(&format!("\"{word}\" is not a number"))
            }
        }
    }

    /// The length of a list.
    fn length(&mut self, kind: Type) -> Result<usize, String> {
        let count = self.number(kind)?;
        if count < 0.0 || count.fract() != 0.0 || count > f64::from(u32::MAX) {
            return self.error("the length of a list must be a whole number that is not negative");
        }
        Ok(count as usize)
    }
}

fn skip(properties: &[Property], body: &mut Body) -> Result<(), String> {
    for property in properties {
        let count = property.list.map_or(Ok(1), |kind| body.length(kind))?;
        for _ in 0..count {
            body.number(property.kind)?;
        }
    }
    Ok(())
}

/// Reads all vertices; whether they have normals and texture coordinates.
fn vertices(
    element: &ElementType,
    body: &mut Body,
    mesh: &mut Mesh,
    attributes: &mut Vec<Attribute>,
) -> Result<(bool, bool), String> {
    let find = |name: &str| element.properties.iter().position(|p| p.name == name && p.list.is_none());
    let all = |names: &[&str]| names.iter().map(|name| find(name)).collect::<Option<Vec<usize>>>();
    let Some(position) = all(&["x", "y", "z"]) else {
        return Err("the vertices have no properties x, y and z".to_owned());
    };
    let normal = all(&["nx", "ny", "nz"]);
    let uv = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]].iter().find_map(|names| all(names));
    let mut further = Further::of(element, false);
    let mut values = vec![0.0; element.properties.len()];
    for _ in 0..element.count {
        for (value, property) in values.iter_mut().zip(&element.properties) {
            match property.list {
                None => *value = body.number(property.kind)?,
                Some(_) => skip(std::slice::from_ref(property), body)?,
            }
        }
        further.take(&values, body)?;
        let vector = |at: &[usize]| DVec3::new(values[at[0]], values[at[1]], values[at[2]]);
        let place = vector(&position);
        if !place.is_finite() {
            return body.error(&format!("a vertex at {place} is not finite"));
        }
        mesh.positions.push(place);
        if let Some(normal) = &normal {
            let n = vector(normal);
            // Scaled first, so that the length neither overflows nor underflows.
            mesh.normals.push((n / n.abs().max_element()).try_normalize().unwrap_or_default());
        }
        if let Some(uv) = &uv {
            let uv = DVec2::new(values[uv[0]], values[uv[1]]);
            if !uv.is_finite() {
                return body.error(&format!("the texture coordinates {uv} are not finite"));
            }
            mesh.uvs.push(uv);
        }
    }
    attributes.extend(further.attributes);
    Ok((normal.is_some(), uv.is_some()))
}

/// What an element has beside what every mesh needs.
struct Further {
    attributes: Vec<Attribute>,
    /// Of each, the properties that it is made of, and what they are divided by.
    parts: Vec<(Vec<usize>, f64)>,
}

impl Further {
    /// Colours `r g b` or `red green blue` are `color`. Of what else there is, names that agree up to their last underscore are one
    /// attribute, of that name, with `_color` behind it if the first of them ends in `_r`. Mitsuba 3.9.1's rules.
    fn of(element: &ElementType, per_face: bool) -> Further {
        const KNOWN: [&str; 12] = ["x", "y", "z", "nx", "ny", "nz", "u", "v", "s", "t", "texture_u", "texture_v"];
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        let scalars = || element.properties.iter().enumerate().filter(|(_, property)| property.list.is_none());
        for names in [["r", "g", "b"], ["red", "green", "blue"]] {
            let at: Vec<usize> =
                names.iter().filter_map(|name| scalars().find(|(_, p)| p.name == *name)).map(|(at, _)| at).collect();
            if at.len() == 3 && groups.is_empty() {
                groups.push(("color".to_owned(), at));
            }
        }
        for (at, property) in scalars().filter(|(_, property)| !KNOWN.contains(&property.name.as_str())) {
            let Some((prefix, postfix)) = property.name.rsplit_once('_') else { continue };
            let name = if postfix == "r" { format!("{prefix}_color") } else { prefix.to_owned() };
            match groups.last_mut() {
                Some((last, members)) if last.strip_suffix("_color").unwrap_or(last) == prefix => members.push(at),
                _ => groups.push((name, vec![at])),
            }
        }
        let kind = if per_face { "face" } else { "vertex" };
        let attributes = groups
            .iter()
            .map(|(name, at)| Attribute {
                name: format!("{kind}_{name}"),
                per_face,
                channels: at.len(),
                values: Vec::new(),
            })
            .collect();
        let largest = |at: &[usize]| match element.properties[at[0]].kind {
            Type::U8 => f64::from(u8::MAX),
            Type::U16 => f64::from(u16::MAX),
            _ => 1.0,
        };
        Further { attributes, parts: groups.into_iter().map(|(_, at)| (at.clone(), largest(&at))).collect() }
    }

    /// Takes the numbers of one vertex or face.
    fn take(&mut self, values: &[f64], body: &Body) -> Result<(), String> {
        for (attribute, (at, largest)) in self.attributes.iter_mut().zip(&self.parts) {
            for &at in at {
                let value = (values[at] / largest) as f32;
                if !value.is_finite() {
                    return body.error(&format!("{} is {}, which is not finite", attribute.name, values[at]));
                }
                attribute.values.push(value);
            }
        }
        Ok(())
    }
}

fn polygons(
    element: &ElementType,
    body: &mut Body,
    mesh: &mut Mesh,
    attributes: &mut Vec<Attribute>,
) -> Result<(), String> {
    let corners = |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index") && p.list.is_some();
    let Some(at) = element.properties.iter().position(corners) else {
        return Err("the faces have no list vertex_indices".to_owned());
    };
    let (before, after) = (&element.properties[..at], &element.properties[at + 1..]);
    let property = &element.properties[at];
    let length = property.list.expect("only a list is looked for");
    let mut further = Further::of(element, true);
    let mut values = vec![0.0; element.properties.len()];
    let read = |properties: &[Property], values: &mut [f64], body: &mut Body| -> Result<(), String> {
        for (value, property) in values.iter_mut().zip(properties) {
            match property.list {
                None => *value = body.number(property.kind)?,
                Some(_) => skip(std::slice::from_ref(property), body)?,
            }
        }
        Ok(())
    };
    for _ in 0..element.count {
        read(before, &mut values[..at], body)?;
        let count = body.length(length)?;
        if count < 3 {
            return body.error(&format!("a face has {count} corners; it must have at least 3"));
        }
        let mut corner = || -> Result<u32, String> {
            let index = body.number(property.kind)?;
            if index < 0.0 || index.fract() != 0.0 || index > f64::from(u32::MAX) {
                return body.error(&format!("{index} is not the number of a vertex"));
            }
            Ok(index as u32)
        };
        let (first, mut last) = (corner()?, corner()?);
        for _ in 2..count {
            let next = corner()?;
            mesh.triangles.push([first, last, next]);
            last = next;
        }
        read(after, &mut values[at + 1..], body)?;
        // A polygon's numbers are those of all of its triangles.
        for _ in 2..count {
            further.take(&values, body)?;
        }
    }
    attributes.extend(further.attributes);
    Ok(())
}
