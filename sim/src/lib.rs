//! Meshes, UR5, ball, contact fields and the MuJoCo world: scenes in, pressure frames out.

pub mod contact;
pub mod frame;
pub mod mesh;
pub mod objects;
pub mod render;
pub mod scene;
pub mod world;

pub use frame::Frame;
pub use scene::Scene;
pub use world::{SimError, World};
