//! Objects of the file, and the connections between them.

use super::document::Document;
use super::record::{Element, Value};
use std::collections::BTreeMap;

/// An object.
pub(super) struct Object<'d, 'a> {
    /// Its name, without its class.
    pub name: String,
    /// E.g. `LimbNode` for a `Model`.
    pub kind: &'a [u8],
    /// The record, named by the object's class, e.g. `Model`.
    pub record: &'d Element<'a>,
}

impl Object<'_, '_> {
    /// Whether its class is `class`.
    pub fn is(&self, class: &str) -> bool {
        self.record.name == class.as_bytes()
    }
}

/// A connection.
#[derive(Clone, Copy)]
pub(super) struct Link<'a> {
    /// Index of the child object.
    pub child: usize,
    /// Index of the parent object.
    pub parent: usize,
    /// The parent's property that the child drives, if it drives one.
    pub property: Option<&'a [u8]>,
}

/// All objects and their connections.
pub(super) struct Graph<'d, 'a> {
    /// The objects, in file order.
    pub objects: Vec<Object<'d, 'a>>,
    /// Connections to the object's children, in file order.
    children: Vec<Vec<Link<'a>>>,
    /// Connections to the object's parents, in file order.
    parents: Vec<Vec<Link<'a>>>,
    by_id: BTreeMap<i64, usize>,
}

impl<'d, 'a> Graph<'d, 'a> {
    /// The objects and connections of a file.
    pub fn read(document: &'d Document<'a>) -> Self {
        let mut objects = Vec::new();
        let mut by_id = BTreeMap::new();
        for record in document
            .record("Objects")
            .map_or(&[][..], |record| &record.children)
        {
            // Without an id nothing can refer to it.
            let Some(&Value::Int(id)) = record.values.first() else {
                continue;
            };
            by_id.entry(id).or_insert(objects.len());
            let name = record.text(1).map_or_else(String::new, display_name);
            objects.push(Object {
                name,
                kind: record.text(2).unwrap_or(b""),
                record,
            });
        }
        let mut graph = Self {
            children: vec![Vec::new(); objects.len()],
            parents: vec![Vec::new(); objects.len()],
            objects,
            by_id,
        };
        for record in document
            .record("Connections")
            .map_or(&[][..], |record| &record.children)
        {
            graph.connect(record);
        }
        graph
    }

    fn connect(&mut self, record: &Element<'a>) {
        let object = |index| record.int(index).and_then(|id| self.with_id(id));
        let (Some(child), Some(parent)) = (object(1), object(2)) else {
            return;
        };
        // An object is a child of another one (OO), or drives one of its properties (OP).
        let property = match record.text(0) {
            Some(b"OO") => None,
            Some(b"OP") => record.text(3),
            _ => return,
        };
        let link = Link {
            child,
            parent,
            property,
        };
        self.children[parent].push(link);
        self.parents[child].push(link);
    }

    /// The object with this id.
    pub fn with_id(&self, id: i64) -> Option<usize> {
        self.by_id.get(&id).copied()
    }

    /// Connections of `object` to children of class `class`.
    pub fn children<'s>(
        &'s self,
        object: usize,
        class: &'s str,
    ) -> impl Iterator<Item = Link<'a>> + 's {
        self.children[object]
            .iter()
            .copied()
            .filter(move |link| self.objects[link.child].is(class))
    }

    /// Connections of `object` to parents of class `class`.
    pub fn parents<'s>(
        &'s self,
        object: usize,
        class: &'s str,
    ) -> impl Iterator<Item = Link<'a>> + 's {
        self.parents[object]
            .iter()
            .copied()
            .filter(move |link| self.objects[link.parent].is(class))
    }

    /// Number of connections of `object`.
    pub fn degree(&self, object: usize) -> usize {
        self.children[object].len() + self.parents[object].len()
    }

    /// Number of all connections.
    pub fn links(&self) -> usize {
        self.children.iter().map(Vec::len).sum()
    }

    /// Indices of all objects of class `class`.
    pub fn of_class<'s>(&'s self, class: &'s str) -> impl Iterator<Item = usize> + 's {
        (0..self.objects.len()).filter(move |&object| self.objects[object].is(class))
    }
}

/// The name without the class that binary files append after `\0\x01`.
fn display_name(raw: &[u8]) -> String {
    let end = raw
        .windows(2)
        .position(|pair| pair == b"\0\x01")
        .unwrap_or(raw.len());
    String::from_utf8_lossy(&raw[..end]).into_owned()
}
