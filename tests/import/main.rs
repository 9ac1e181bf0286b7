//! Importers compared with evaluations of the formats' own formulas, which share no code with them.

mod acclaim;
mod acclaim_reference;
mod bvh;
mod damage;
mod deepmimic;
#[cfg(feature = "ufbx")]
mod fbx_kinds;
#[cfg(feature = "ufbx")]
mod fbx_rewritten;
#[cfg(feature = "ufbx")]
mod formats;
mod gltf;
mod gltf_faults;
mod gltf_kept;
mod gltf_made;
mod gltf_reference;
mod maps;
mod robust;
mod vrm;
