//! Properties of objects, with their defaults from the file's templates.

use super::document::Document;
use super::record::{Element, Value};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A property's values come after its name, type, label and flags.
const VALUES_AT: usize = 4;

/// The values of a template's properties by their names.
type Template<'d, 'a> = BTreeMap<&'a [u8], &'d [Value<'a>]>;

/// Property templates by class of object.
pub(super) struct Templates<'d, 'a> {
    by_class: BTreeMap<&'a [u8], Template<'d, 'a>>,
}

impl<'d, 'a> Templates<'d, 'a> {
    /// The templates of a file.
    pub fn read(document: &'d Document<'a>) -> Self {
        let mut by_class = BTreeMap::new();
        let kinds = document
            .record("Definitions")
            .map_or(&[][..], |record| &record.children);
        for kind in kinds.iter().filter(|kind| kind.name == b"ObjectType") {
            let template = kind
                .child("PropertyTemplate")
                .and_then(|template| template.child("Properties70"));
            if let (Some(class), Some(template)) = (kind.text(0), template) {
                by_class.entry(class).or_insert_with(|| index(template));
            }
        }
        Self { by_class }
    }

    /// The properties of `object`, a record of class `object.name`.
    pub fn properties<'s>(&'s self, object: &'d Element<'a>) -> Properties<'s, 'd, 'a> {
        Properties {
            own: object.child("Properties70"),
            template: self.by_class.get(object.name),
        }
    }
}

/// The properties of a template by name: the first of each name counts.
fn index<'d, 'a>(list: &'d Element<'a>) -> Template<'d, 'a> {
    let mut index = Template::new();
    for property in &list.children {
        if let (Some(name), Some(values)) = (property.text(0), property.values.get(VALUES_AT..)) {
            index.entry(name).or_insert(values);
        }
    }
    index
}

/// An object's own properties over those of its template.
#[derive(Clone, Copy)]
pub(super) struct Properties<'s, 'd, 'a> {
    own: Option<&'d Element<'a>>,
    template: Option<&'s Template<'d, 'a>>,
}

impl<'d, 'a> Properties<'_, 'd, 'a> {
    /// The properties of a record without a template.
    pub fn of(record: &'d Element<'a>) -> Self {
        Self {
            own: record.child("Properties70"),
            template: None,
        }
    }

    /// The values of a property, the object's own before those of its template.
    fn values(&self, name: &str) -> Option<&'d [Value<'a>]> {
        // Objects have few properties, so a search is quicker than an index; templates have many objects each.
        let find = |list: &'d Element<'a>| {
            let property = list
                .children
                .iter()
                .find(|p| p.text(0) == Some(name.as_bytes()))?;
            property.values.get(VALUES_AT..)
        };
        let template = || self.template?.get(name.as_bytes()).copied();
        self.own.and_then(find).or_else(template)
    }

    /// A property that is an integer.
    pub fn int(&self, name: &str) -> Option<i64> {
        self.values(name)?.first()?.int()
    }

    /// A property that is a real.
    pub fn real(&self, name: &str) -> Option<f64> {
        self.values(name)?.first()?.real()
    }

    /// A property that is a vector.
    pub fn vector(&self, name: &str) -> Option<Vector3<f64>> {
        match self.values(name)? {
            [x, y, z, ..] => Some(Vector3::new(x.real()?, y.real()?, z.real()?)),
            _ => None,
        }
    }
}
