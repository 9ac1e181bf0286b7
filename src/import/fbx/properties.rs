//! Properties of objects, with the defaults that the file's templates state.

use super::document::{Document, Element, Value};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Name, type, label and flags stand before a property's values.
const VALUES_AT: usize = 4;

/// Property templates by class of object.
pub(super) struct Templates<'d, 'a> {
    by_class: BTreeMap<&'a [u8], &'d Element<'a>>,
}

impl<'d, 'a> Templates<'d, 'a> {
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
                by_class.entry(class).or_insert(template);
            }
        }
        Self { by_class }
    }

    /// The properties of `object`, a record of class `object.name`.
    pub fn properties(&self, object: &'d Element<'a>) -> Properties<'d, 'a> {
        Properties {
            own: object.child("Properties70"),
            template: self.by_class.get(object.name).copied(),
        }
    }
}

/// An object's own properties over those of its template.
#[derive(Clone, Copy)]
pub(super) struct Properties<'d, 'a> {
    own: Option<&'d Element<'a>>,
    template: Option<&'d Element<'a>>,
}

impl<'d, 'a> Properties<'d, 'a> {
    pub fn of(record: &'d Element<'a>) -> Self {
        Self {
            own: record.child("Properties70"),
            template: None,
        }
    }

    fn values(&self, name: &str) -> Option<&'d [Value<'a>]> {
        let find = |list: &'d Element<'a>| {
            let property = list
                .children
                .iter()
                .find(|p| p.text(0) == Some(name.as_bytes()))?;
            property.values.get(VALUES_AT..)
        };
        self.own
            .and_then(find)
            .or_else(|| self.template.and_then(find))
    }

    pub fn int(&self, name: &str) -> Option<i64> {
        self.values(name)?.first()?.int()
    }

    pub fn real(&self, name: &str) -> Option<f64> {
        self.values(name)?.first()?.real()
    }

    pub fn vector(&self, name: &str) -> Option<Vector3<f64>> {
        match self.values(name)? {
            [x, y, z, ..] => Some(Vector3::new(x.real()?, y.real()?, z.real()?)),
            _ => None,
        }
    }
}
