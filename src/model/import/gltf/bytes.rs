//! Buffers, buffer views and accessors (glTF 2.0, 3.6). Nothing in the file is believed: an element is only reachable through
//! [`Elements`], whose last one is known to lie inside its buffer, and whose count is at most the bytes that hold it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::schema::{Accessor, Document, Sparse};
use super::{broken, pick};
use crate::Result;
use crate::model::import::folder::Folder;

/// The bytes that the document points into.
pub struct Bytes<'a> {
    buffers: Vec<Result<Source<'a>, String>>,
}

/// Where a buffer's bytes are.
#[derive(Clone)]
enum Source<'a> {
    Chunk(&'a [u8]),
    Own(Arc<[u8]>),
}

impl Source<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Own(bytes) => bytes,
        }
    }
}

impl<'a> Bytes<'a> {
    /// Fetches every buffer; one that cannot be had is only missed when something points into it.
    pub fn fetch(document: &Document, binary: Option<&'a [u8]>, folder: &Folder) -> Self {
        let mut fetched = BTreeMap::new();
        let buffers = document.buffers.iter().enumerate().map(|(number, buffer)| match (&buffer.uri, binary) {
            // Many buffers may name one file.
            (Some(uri), _) => fetched.entry(uri).or_insert_with(|| folder.uri(uri).map(Arc::<[u8]>::from)).clone().map(Source::Own),
            (None, Some(binary)) if number == 0 => Ok(Source::Chunk(binary)),
            (None, _) => Err("has no bytes".to_owned()),
        });
        Self { buffers: buffers.collect() }
    }

    /// The bytes of a buffer view, and the stride that it declares.
    pub fn view(&self, document: &Document, view: usize) -> Result<(&[u8], Option<usize>)> {
        let about = pick(&document.buffer_views, view, "buffer view")?;
        let buffer = pick(&self.buffers, about.buffer, "buffer")?;
        let buffer = buffer.as_ref().map_err(|why| broken(format!("buffer {} {why}", about.buffer)))?.bytes();
        let end = about.byte_offset.checked_add(about.byte_length);
        let bytes = end.and_then(|end| buffer.get(about.byte_offset..end));
        let bytes = bytes.ok_or_else(|| {
            broken(format!(
                "buffer view {view} wants {} bytes from {}, but its buffer has {}",
                about.byte_length,
                about.byte_offset,
                buffer.len()
            ))
        })?;
        Ok((bytes, about.byte_stride.filter(|stride| *stride > 0)))
    }

    /// An accessor, ready to be read. One without bytes is all zeros; `most` is how many of those may be made up.
    pub fn elements(&self, document: &Document, accessor: usize, most: usize) -> Result<Elements<'_>> {
        let about = pick(&document.accessors, accessor, "accessor")?;
        let layout = Layout::of(about).ok_or_else(|| broken(format!("accessor {accessor} is of no kind that glTF knows")))?;
        let mut elements = match about.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(document, view)?;
                let bytes = bytes.get(about.byte_offset..);
                let stride = stride.unwrap_or(layout.size());
                let reach = |bytes: &&[u8]| reaches(bytes.len(), about.count, stride, layout.size());
                let bytes = bytes.filter(reach).ok_or_else(|| {
                    broken(format!("accessor {accessor} wants {} elements, but its buffer view ends before", about.count))
                })?;
                Elements { bytes: Cow::Borrowed(bytes), stride, count: about.count, layout }
            }
            None if about.count <= most => {
                let zeros = vec![0; about.count * layout.size()];
                Elements { bytes: Cow::Owned(zeros), stride: layout.size(), count: about.count, layout }
            }
            None => return Err(broken(format!("accessor {accessor} wants {} elements from no bytes", about.count))),
        };
        if let Some(sparse) = &about.sparse {
            self.overlay(document, accessor, sparse, &mut elements)?;
        }
        Ok(elements)
    }

    /// Puts the values of a sparse accessor over its base.
    fn overlay(&self, document: &Document, accessor: usize, sparse: &Sparse, base: &mut Elements) -> Result<()> {
        let wrong = |what: &str| broken(format!("the sparse accessor {accessor} {what}"));
        let component = Component::of(sparse.indices.component_type).filter(|c| c.is_index());
        let component = component.ok_or_else(|| wrong("has indices of a kind that glTF does not know"))?;
        let layout = base.layout;
        let part = |view: usize, offset: usize, size: usize| -> Result<&[u8]> {
            let bytes = self.view(document, view)?.0.get(offset..);
            bytes.filter(|b| reaches(b.len(), sparse.count, size, size)).ok_or_else(|| wrong("reaches beyond its bytes"))
        };
        let indices = part(sparse.indices.buffer_view, sparse.indices.byte_offset, component.size())?;
        let values = part(sparse.values.buffer_view, sparse.values.byte_offset, layout.size())?;
        let mut dense = base.packed();
        for (index, value) in indices.chunks_exact(component.size()).zip(values.chunks_exact(layout.size())).take(sparse.count) {
            let start = component.index(index) as usize * layout.size();
            let target = dense.get_mut(start..start + layout.size()).ok_or_else(|| wrong("has an index beyond its count"))?;
            target.copy_from_slice(value);
        }
        *base = Elements { bytes: Cow::Owned(dense), stride: layout.size(), ..*base };
        Ok(())
    }
}

/// Whether `count` elements of `size` bytes, `stride` apart, fit into `length` bytes. Overlapping ones do not: a small file would
/// stand for a large one.
fn reaches(length: usize, count: usize, stride: usize, size: usize) -> bool {
    let Some(steps) = count.checked_sub(1) else { return true };
    stride >= size && steps.checked_mul(stride).and_then(|start| start.checked_add(size)).is_some_and(|end| end <= length)
}

/// The kinds of numbers that glTF knows (specification, 3.6.2.2).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u64) -> Option<Self> {
        Some(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }

    /// The whole number that the bytes stand for.
    fn index(self, bytes: &[u8]) -> u32 {
        match (self, bytes) {
            (Self::U8, [a, ..]) => u32::from(*a),
            (Self::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
            (_, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => 0,
        }
    }

    /// The number that the bytes stand for; a normalised whole number becomes 0..1 or −1..1.
    fn number(self, bytes: &[u8], normalized: bool) -> f32 {
        let (value, largest) = match (self, bytes) {
            (Self::I8, [a, ..]) => (f32::from(*a as i8), 127.0),
            (Self::U8, [a, ..]) => (f32::from(*a), 255.0),
            (Self::I16, [a, b, ..]) => (f32::from(i16::from_le_bytes([*a, *b])), 32_767.0),
            (Self::U16, [a, b, ..]) => (f32::from(u16::from_le_bytes([*a, *b])), 65_535.0),
            (Self::U32, [a, b, c, d, ..]) => (u32::from_le_bytes([*a, *b, *c, *d]) as f32, u32::MAX as f32),
            (_, [a, b, c, d, ..]) => return f32::from_le_bytes([*a, *b, *c, *d]),
            _ => return 0.0,
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }
}

/// How one element is laid out.
#[derive(Clone, Copy)]
struct Layout {
    component: Component,
    width: usize,
    normalized: bool,
}

impl Layout {
    fn of(accessor: &Accessor) -> Option<Self> {
        let width = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return None,
        };
        Some(Self { component: Component::of(accessor.component_type)?, width, normalized: accessor.normalized })
    }

    fn size(self) -> usize {
        self.component.size() * self.width
    }
}

/// The elements of one accessor: `count` of them, all inside the file.
pub struct Elements<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
    count: usize,
    layout: Layout,
}

impl Elements<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether they are whole numbers without sign, as indices are.
    pub fn are_indices(&self) -> bool {
        self.layout.width == 1 && self.layout.component.is_index()
    }

    /// One element as numbers; `rest` stands for what it does not have.
    pub fn vector<const N: usize>(&self, element: usize, rest: f32) -> [f32; N] {
        let Layout { component, width, normalized } = self.layout;
        let bytes = &self.bytes[element * self.stride..];
        let number = |k: usize| component.number(&bytes[k * component.size()..], normalized);
        std::array::from_fn(|k| if k < width { number(k) } else { rest })
    }

    /// One element as a whole number.
    pub fn index(&self, element: usize) -> u32 {
        self.layout.component.index(&self.bytes[element * self.stride..])
    }

    /// The elements without gaps.
    fn packed(&self) -> Vec<u8> {
        let size = self.layout.size();
        (0..self.count).flat_map(|element| &self.bytes[element * self.stride..][..size]).copied().collect()
    }
}
