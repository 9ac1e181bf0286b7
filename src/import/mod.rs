//! Bytes of an animation file become a [`Clip`](crate::clip::Clip).

mod scene;
