//! Numbers out of a glTF file's buffers. Every index, offset, stride and count is checked against the bytes there are.

use super::GltfError;
use super::buffer::Buffers;
use super::document::{Accessor, Document, Sparse};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Most numbers that all accessors of a file may hold together; a few bytes of JSON can ask for any amount.
const MOST_NUMBERS: usize = 64 << 20;

/// Reads accessors, each once.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    done: BTreeMap<usize, Rc<[f64]>>,
    numbers: usize,
}

/// Encoding of one number.
#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// Where the elements of an accessor lie in a buffer view.
struct Layout {
    view: usize,
    offset: usize,
    count: usize,
    /// Numbers per element.
    width: usize,
    component: Component,
    normalized: bool,
}

impl<'a> Accessors<'a> {
    pub fn new(document: &'a Document, buffers: Buffers<'a>) -> Self {
        Self {
            document,
            buffers,
            done: BTreeMap::new(),
            numbers: 0,
        }
    }

    /// Whether the file has this accessor and nothing is in it.
    pub fn is_empty(&self, accessor: usize) -> bool {
        self.document
            .accessors
            .get(accessor)
            .is_some_and(|about| about.count == 0)
    }

    /// All numbers of an accessor whose elements are of type `shape` (`SCALAR`, `VEC3`, `VEC4`, `MAT4`), in order.
    pub fn read(&mut self, accessor: usize, shape: &str) -> Result<Rc<[f64]>, GltfError> {
        let broken = |reason: String| GltfError::Accessor { accessor, reason };
        let about = self.document.accessors.get(accessor);
        let about = about.ok_or_else(|| broken("the file has no such accessor".to_owned()))?;
        if about.shape != shape {
            return Err(broken(format!(
                "it is {} where {shape} is wanted",
                about.shape
            )));
        }
        if let Some(done) = self.done.get(&accessor) {
            return Ok(done.clone());
        }
        let numbers: Rc<[f64]> = self.numbers(about).map_err(broken)?.into();
        self.done.insert(accessor, numbers.clone());
        Ok(numbers)
    }

    fn numbers(&mut self, about: &Accessor) -> Result<Vec<f64>, String> {
        let width = match about.shape.as_str() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => return Err(format!("elements of type {other}")),
        };
        let length = about.count.checked_mul(width).ok_or("too many elements")?;
        self.numbers = self.numbers.saturating_add(length);
        if self.numbers > MOST_NUMBERS {
            return Err(format!(
                "with it the file asks for more than {MOST_NUMBERS} numbers"
            ));
        }
        let component = Component::new(about.component_type)?;
        let mut numbers = match about.buffer_view {
            Some(view) => self.elements(&Layout {
                view,
                offset: about.byte_offset,
                count: about.count,
                width,
                component,
                normalized: about.normalized,
            })?,
            None => vec![0.0; length],
        };
        if let Some(sparse) = &about.sparse {
            if sparse.count > about.count {
                return Err(format!(
                    "{} sparse values for {} elements",
                    sparse.count, about.count
                ));
            }
            let values = Layout {
                view: sparse.values.buffer_view,
                offset: sparse.values.byte_offset,
                count: sparse.count,
                width,
                component,
                normalized: about.normalized,
            };
            self.substitute(sparse, &values, &mut numbers)?;
        }
        Ok(numbers)
    }

    /// Puts the values of a sparse accessor, laid out as `values` says, over `numbers`.
    fn substitute(
        &mut self,
        sparse: &Sparse,
        values: &Layout,
        numbers: &mut [f64],
    ) -> Result<(), String> {
        let kind = sparse
            .indices
            .component_type
            .ok_or("sparse indices without a type")?;
        let indices = self.elements(&Layout {
            view: sparse.indices.buffer_view,
            offset: sparse.indices.byte_offset,
            count: sparse.count,
            width: 1,
            component: Component::new(kind)?,
            normalized: false,
        })?;
        let width = values.width;
        let values = self.elements(values)?;
        for (index, value) in indices.iter().zip(values.chunks_exact(width)) {
            let at = (*index as usize).checked_mul(width);
            let place = at.and_then(|at| numbers.get_mut(at..at.checked_add(width)?));
            place
                .ok_or(format!("sparse index {index} is out of range"))?
                .copy_from_slice(value);
        }
        Ok(())
    }

    /// The elements that `layout` describes, provided that all of them lie in the view and the view in its buffer.
    fn elements(&mut self, layout: &Layout) -> Result<Vec<f64>, String> {
        let view = self.document.buffer_views.get(layout.view);
        let view = view.ok_or_else(|| format!("no buffer view {}", layout.view))?;
        if let Some(name) = view
            .extensions
            .keys()
            .find(|name| name.contains("meshopt_compression"))
        {
            return Err(format!(
                "it is packed with {name}; unpack it, with gltfpack or gltf-transform"
            ));
        }
        let bytes = self.buffers.get(view.buffer).map_err(|e| e.to_string())?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| bytes.get(view.byte_offset..end));
        let bytes = bytes
            .ok_or_else(|| format!("buffer view {} is longer than its buffer", layout.view))?;
        let size = layout.component.size() * layout.width;
        let stride = view
            .byte_stride
            .filter(|&stride| stride > 0)
            .unwrap_or(size);
        if stride < size {
            return Err(format!("elements of {size} bytes stand {stride} apart"));
        }
        let last = layout.count.saturating_sub(1).checked_mul(stride);
        let end = last.and_then(|last| last.checked_add(size)?.checked_add(layout.offset));
        if layout.count > 0 && end.is_none_or(|end| end > bytes.len()) {
            return Err(format!(
                "{} elements don't fit buffer view {}",
                layout.count, layout.view
            ));
        }
        let mut numbers = Vec::with_capacity(layout.count * layout.width);
        for element in 0..layout.count {
            let at = layout.offset + element * stride;
            let element = bytes.get(at..at + size).unwrap_or_default();
            let parts = element.chunks_exact(layout.component.size());
            numbers.extend(parts.map(|part| layout.component.number(part, layout.normalized)));
        }
        Ok(numbers)
    }
}

impl Component {
    fn new(code: u32) -> Result<Self, String> {
        match code {
            5120 => Ok(Self::I8),
            5121 => Ok(Self::U8),
            5122 => Ok(Self::I16),
            5123 => Ok(Self::U16),
            5125 => Ok(Self::U32),
            5126 => Ok(Self::F32),
            other => Err(format!("unknown component type {other}")),
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that `bytes`, [`Self::size`] long, hold. Normalised integers become −1…1 or 0…1 (specification §3.6.2.2).
    fn number(self, bytes: &[u8], normalized: bool) -> f64 {
        let mut word = [0; 4];
        word.iter_mut()
            .zip(bytes)
            .for_each(|(to, from)| *to = *from);
        let [a, b, ..] = word;
        let (number, most) = match self {
            Self::I8 => (f64::from(a.cast_signed()), f64::from(i8::MAX)),
            Self::U8 => (f64::from(a), f64::from(u8::MAX)),
            Self::I16 => (f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX)),
            Self::U16 => (f64::from(u16::from_le_bytes([a, b])), f64::from(u16::MAX)),
            Self::U32 => (f64::from(u32::from_le_bytes(word)), f64::from(u32::MAX)),
            Self::F32 => return f64::from(f32::from_le_bytes(word)),
        };
        if normalized {
            (number / most).max(-1.0)
        } else {
            number
        }
    }
}
