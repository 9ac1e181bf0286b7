//! Numbers out of a glTF file's buffers. Every index, offset, stride and count is checked against the bytes that there are.

use super::buffer::Buffers;
use super::document::{Document, size};
use super::error::{Fault, GltfError};
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, buffer::View};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Numbers that all accessors of a file may hold together, and how many more per byte that was read. Real files don't read
/// their bytes many times over, but a few bytes of JSON can ask for any amount. Chosen.
const FREE_NUMBERS: usize = 1 << 16;
const NUMBERS_PER_BYTE: usize = 4;
/// Most numbers that all curves together may use, counting a shared accessor each time. Chosen, as a bound on time.
const MOST_USED: usize = 1 << 28;

/// Reads accessors, each of them once.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    done: BTreeMap<usize, Rc<[f64]>>,
    /// Numbers in memory.
    numbers: usize,
    /// Numbers that curves use, counting a shared accessor each time.
    used: usize,
}

/// Where the elements of an accessor lie in a buffer view.
struct Layout {
    view: usize,
    offset: usize,
    count: usize,
    /// Numbers per element.
    width: usize,
    component: ComponentType,
    normalized: bool,
}

impl<'a> Accessors<'a> {
    pub fn new(document: &'a Document, buffers: Buffers<'a>) -> Self {
        Self {
            document,
            buffers,
            done: BTreeMap::new(),
            numbers: 0,
            used: 0,
        }
    }

    /// Bytes that were read from other files.
    pub fn bytes_beside(&self) -> usize {
        self.buffers.bytes_beside()
    }

    /// Whether the file has this accessor and it is empty.
    pub fn is_empty(&self, accessor: Index<Accessor>) -> bool {
        self.document
            .accessors
            .get(accessor.value())
            .is_some_and(|about| about.count.0 == 0)
    }

    /// All numbers of an accessor whose elements must be of type `wanted`, in order.
    pub fn read(
        &mut self,
        accessor: Index<Accessor>,
        wanted: Type,
    ) -> Result<Rc<[f64]>, GltfError> {
        let accessor = accessor.value();
        let broken = |fault: Fault| GltfError::Accessor { accessor, fault };
        let about = self.document.accessors.get(accessor);
        let about = about.ok_or_else(|| broken("the file has no such accessor".into()))?;
        if about.type_ != Checked::Valid(wanted) {
            let kind = match about.type_ {
                Checked::Valid(kind) => format!("{kind:?}").to_uppercase(),
                Checked::Invalid => "of an unknown type".to_owned(),
            };
            let wanted = format!("{wanted:?}").to_uppercase();
            return Err(broken(
                format!("it is {kind} where {wanted} is wanted").into(),
            ));
        }
        let numbers = match self.done.get(&accessor) {
            Some(done) => done.clone(),
            None => self
                .numbers(about, wanted.multiplicity())
                .map_err(broken)?
                .into(),
        };
        self.done.insert(accessor, numbers.clone());
        self.used = self.used.saturating_add(numbers.len());
        if self.used > MOST_USED {
            return Err(broken("it is shared implausibly often".into()));
        }
        Ok(numbers)
    }

    /// Counts numbers that are about to be put in memory.
    fn hold(&mut self, numbers: usize) -> Result<(), Fault> {
        self.numbers = self.numbers.saturating_add(numbers);
        let most = self.buffers.bytes().saturating_mul(NUMBERS_PER_BYTE);
        let most = most.saturating_add(FREE_NUMBERS);
        if self.numbers > most {
            return Err(format!("with it the file asks for more than {most} numbers").into());
        }
        Ok(())
    }

    /// The numbers of an accessor, `width` per element: those of its buffer view, or zeros, with its sparse values over them.
    fn numbers(&mut self, about: &Accessor, width: usize) -> Result<Vec<f64>, Fault> {
        let count = size(about.count);
        let length = count.checked_mul(width).ok_or("too many elements")?;
        let Checked::Valid(component) = about.component_type else {
            return Err("unknown component type".into());
        };
        let layout = |view: Index<View>, offset: USize64, count| Layout {
            view: view.value(),
            offset: size(offset),
            count,
            width,
            component: component.0,
            normalized: about.normalized,
        };
        // Without a buffer view all numbers are zero, to be overwritten by sparse ones.
        let mut numbers = match about.buffer_view {
            Some(view) => {
                self.elements(&layout(view, about.byte_offset.unwrap_or_default(), count))?
            }
            None => {
                self.hold(length)?;
                vec![0.0; length]
            }
        };
        if let Some(sparse) = &about.sparse {
            let (some, indices, values) = (size(sparse.count), &sparse.indices, &sparse.values);
            if some > count {
                return Err(format!("{some} sparse values for {count} elements").into());
            }
            let Checked::Valid(kind) = indices.component_type else {
                return Err("unknown component type of its sparse indices".into());
            };
            let indices = self.elements(&Layout {
                width: 1,
                component: kind.0,
                normalized: false,
                ..layout(indices.buffer_view, indices.byte_offset, some)
            })?;
            let values = self.elements(&layout(values.buffer_view, values.byte_offset, some))?;
            overwrite(&mut numbers, width, &indices, &values)?;
        }
        Ok(numbers)
    }

    /// The numbers of the elements that `layout` describes, if all of them are inside the view and the view is inside its
    /// buffer.
    fn elements(&mut self, layout: &Layout) -> Result<Vec<f64>, Fault> {
        let view = self.document.buffer_views.get(layout.view);
        let view = view.ok_or_else(|| format!("no buffer view {}", layout.view))?;
        if let Some(name) = self.document.packing(layout.view) {
            return Err(Fault::new(
                format!("it is packed with {name}"),
                "unpack it, with gltfpack or gltf-transform",
            ));
        }
        let length = layout.count.checked_mul(layout.width);
        let length = length.ok_or("too many elements")?;
        let buffer = view.buffer.value();
        self.buffers.get(buffer)?;
        self.hold(length)?;
        let bytes = self.buffers.get(buffer)?;
        // The view's bytes in its buffer.
        let start = size(view.byte_offset.unwrap_or_default());
        let end = start.checked_add(size(view.byte_length));
        let bytes = end
            .and_then(|end| bytes.get(start..end))
            .ok_or_else(|| format!("buffer view {} is longer than its buffer", layout.view))?;
        let size = layout.component.size() * layout.width;
        let stride = view
            .byte_stride
            .map(|stride| stride.0)
            .filter(|&stride| stride > 0)
            .unwrap_or(size);
        if stride < size {
            return Err(format!("elements of {size} bytes are only {stride} bytes apart").into());
        }
        // The last element must end within the view.
        let last = layout.count.saturating_sub(1).checked_mul(stride);
        let end = last.and_then(|last| last.checked_add(size)?.checked_add(layout.offset));
        if layout.count > 0 && end.is_none_or(|end| end > bytes.len()) {
            let (count, view) = (layout.count, layout.view);
            return Err(format!("{count} elements don't fit buffer view {view}").into());
        }
        let mut numbers = Vec::with_capacity(length);
        for element in 0..layout.count {
            let at = layout.offset + element * stride;
            let element = bytes.get(at..at + size).unwrap_or_default();
            let parts = element.chunks_exact(layout.component.size());
            numbers.extend(parts.map(|part| number(layout.component, part, layout.normalized)));
        }
        Ok(numbers)
    }
}

/// Puts sparse `values`, `width` numbers each, in the places of `indices`.
fn overwrite(
    numbers: &mut [f64],
    width: usize,
    indices: &[f64],
    values: &[f64],
) -> Result<(), Fault> {
    for (index, value) in indices.iter().zip(values.chunks_exact(width)) {
        let at = (*index as usize)
            .checked_mul(width)
            .and_then(|at| numbers.get_mut(at..at.checked_add(width)?));
        at.ok_or(format!("sparse index {index} is out of range"))?
            .copy_from_slice(value);
    }
    Ok(())
}

/// The number in `bytes`. Normalised integers become −1…1 or 0…1 (glTF 2.0 specification, §3.6.2.2).
fn number(component: ComponentType, bytes: &[u8], normalized: bool) -> f64 {
    let mut word = [0; 4];
    word.iter_mut()
        .zip(bytes)
        .for_each(|(to, from)| *to = *from);
    let [a, b, ..] = word;
    let (number, most) = match component {
        ComponentType::I8 => (f64::from(a.cast_signed()), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(a), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([a, b])), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(word)), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(word)),
    };
    // The smallest signed integer has no positive counterpart: it becomes −1 as well.
    if normalized {
        (number / most).max(-1.0)
    } else {
        number
    }
}
