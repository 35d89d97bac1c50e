//! Meshes, UR5, ball, contact fields and the MuJoCo world: scenes in, pressure frames out.

pub mod contact;
pub mod frame;
pub mod mesh;
pub mod objects;
