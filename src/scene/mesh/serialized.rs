//! Mitsuba's own mesh files, `.serialized`: versions 3 and 4. One file holds any number of meshes, each compressed by
//! itself, and ends with a table of where they start. The layout is described in Mitsuba 0.6's manual, section 8.1.4.

use std::io::Read;

use flate2::read::ZlibDecoder;
use glam::{DVec2, DVec3};

use super::{Attribute, FileMesh};
use crate::scene::Mesh;

const MAGIC: u16 = 0x041c;

/// Bits of the flags that begin a mesh.
const NORMALS: u32 = 0x1;
const UVS: u32 = 0x2;
const COLORS: u32 = 0x8;
const SINGLE: u32 = 0x1000;
const DOUBLE: u32 = 0x2000;

/// Reads mesh number `shape_index`, from 0. Colours are left out, and so is the flag for flat normals, as in Mitsuba 3.9.1. The
/// error says what is wrong.
pub fn parse(bytes: &[u8], shape_index: u64) -> Result<FileMesh, String> {
    let short = || "the file is too short to be a .serialized file".to_owned();
    let version = header(bytes).ok_or_else(short)??;
    let count_at = bytes.len().checked_sub(4).ok_or_else(short)?;
    let count = u64::from(u32::from_le_bytes(bytes[count_at..].try_into().expect("four bytes")));
    if shape_index >= count {
        return Err(format!("shape_index is {shape_index}, but the file has {count} meshes, which count from 0"));
    }
    let entry = if version == 4 { 8 } else { 4 };
    let table = (count * entry).try_into().ok().and_then(|length: usize| count_at.checked_sub(length));
    let table = table.ok_or("the table at the end is longer than the file")?;
    let at = table + (shape_index * entry) as usize;
    let mut offset = [0; 8];
    offset[..entry as usize].copy_from_slice(&bytes[at..at + entry as usize]);
    let start = usize::try_from(u64::from_le_bytes(offset)).unwrap_or(usize::MAX);
    let mesh = bytes[..table].get(start..).ok_or("the table at the end points behind the file")?;
    let version = header(mesh).ok_or_else(short)??;
    Stream { inner: ZlibDecoder::new(&mesh[4..]) }.mesh(version)
}

/// The version in the first four bytes.
fn header(bytes: &[u8]) -> Option<Result<u16, String>> {
    let number = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
    let (magic, version) = (number(0)?, number(2)?);
    Some(match (magic, version) {
        (MAGIC, 3 | 4) => Ok(version),
        (MAGIC, _) => Err(format!("version {version} of the format is not known; known are 3 and 4")),
        _ => Err("this is not a .serialized file: its first bytes are wrong".to_owned()),
    })
}

/// A compressed mesh.
struct Stream<R> {
    inner: R,
}

impl<R: Read> Stream<R> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.inner.read_exact(&mut bytes).map_err(|cause| format!("the mesh cannot be decompressed: {cause}"))?;
        Ok(bytes)
    }

    fn real(&mut self, double: bool) -> Result<f64, String> {
        let value = if double { f64::from_le_bytes(self.bytes()?) } else { f32::from_le_bytes(self.bytes()?).into() };
        if value.is_finite() { Ok(value) } else { Err(format!("the mesh has a value that is not finite: {value}")) }
    }

    fn vectors(&mut self, count: u64, double: bool) -> Result<Vec<DVec3>, String> {
        // Not allocated in advance: a wrong count ends with the file, not with the memory.
        (0..count).map(|_| Ok(DVec3::new(self.real(double)?, self.real(double)?, self.real(double)?))).collect()
    }

    fn mesh(&mut self, version: u16) -> Result<FileMesh, String> {
        let flags = u32::from_le_bytes(self.bytes()?);
        let double = match flags & (SINGLE | DOUBLE) {
            SINGLE => false,
            DOUBLE => true,
            _ => return Err("the mesh is neither in single nor in double precision".to_owned()),
        };
        if version == 4 {
            // The name.
            while self.bytes()? != [0] {}
        }
        let vertices = u64::from_le_bytes(self.bytes()?);
        let triangles = u64::from_le_bytes(self.bytes()?);
        if vertices > u64::from(u32::MAX) {
            return Err(format!("the mesh has {vertices} vertices, which is more than the limit of {}", u32::MAX));
        }
        let mut mesh = Mesh { positions: self.vectors(vertices, double)?, ..Mesh::default() };
        if flags & NORMALS != 0 {
            let normals = self.vectors(vertices, double)?;
            // Scaled first, so that the length neither overflows nor underflows.
            let unit = |n: DVec3| (n / n.abs().max_element()).try_normalize().unwrap_or_default();
            mesh.normals = normals.into_iter().map(unit).collect();
        }
        if flags & UVS != 0 {
            mesh.uvs = (0..vertices)
                .map(|_| Ok(DVec2::new(self.real(double)?, self.real(double)?)))
                .collect::<Result<_, String>>()?;
        }
        let mut attributes = Vec::new();
        if flags & COLORS != 0 {
            let colors = self.vectors(vertices, double)?;
            let values = colors.iter().flat_map(|color| color.as_vec3().to_array()).collect();
            attributes.push(Attribute { name: "vertex_color".to_owned(), per_face: false, channels: 3, values });
        }
        for _ in 0..triangles {
            let mut corners = [0; 3];
            for corner in &mut corners {
                *corner = u32::from_le_bytes(self.bytes()?);
                if u64::from(*corner) >= vertices {
                    return Err(format!("a triangle names vertex {corner}, but the mesh has {vertices} vertices"));
                }
            }
            mesh.triangles.push(corners);
        }
        Ok(FileMesh { mesh, attributes, missing_uvs: 0 })
    }
}
