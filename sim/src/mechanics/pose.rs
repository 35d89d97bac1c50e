//! The scene's body in a given pose.

use super::Mechanics;
use spts_contact::{Pose, PosedMesh};

impl Mechanics {
    /// The scene's body at rest in the pose of a frame, to evaluate a contact field at that instant again.
    #[must_use]
    pub fn posed(&self, pose: &Pose) -> PosedMesh<'_> {
        let (body, _) = self.contact_body();
        PosedMesh {
            rotation: matrix(pose.quaternion),
            ..PosedMesh {
                stiffness_pa_per_m: body.stiffness_pa_per_m,
                ..PosedMesh::at_rest(body.mesh, pose.position_m)
            }
        }
    }
}

/// Rotation matrix, row-major, of a unit quaternion (w, x, y, z).
fn matrix([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    /// The field at the pose of a frame on the plateau, where nothing moves, gives the frame's force again: to the
    /// remaining motion, below 0.01 mm/s · 0.5 ms of damping in 1 mm of depth.
    #[test]
    fn a_frame_can_be_looked_at_again() {
        let scene = Mechanics::press("T").unwrap();
        let mut world = World::new(&scene).unwrap();
        let frame = world.frames().map(Result::unwrap).find(|f| f.time_s > 0.9).unwrap();
        let mut field = scene.build_contact().unwrap();
        let force_n = field.respond(&scene.posed(&frame.pose)).wrench.force_n[2];
        approx::assert_relative_eq!(force_n, frame.wrench.force_n[2], max_relative = 1e-4);
    }
}
