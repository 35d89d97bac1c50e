//! Foam under a body as a few springs, which a physics engine can solve together with all its other constraints.

use crate::balance::Column;
use crate::field::PosedMesh;
use crate::foam::FoamLaw;
use crate::traction::velocity_at;
use parry3d_f64::math::Vector;

/// A spring and damper that stands, with others, for the foam under a body during one step of an engine.
///
/// With v the velocity of the body along the normal at the end of the step, its force on the body along the normal is
/// F − k (Δt + τ) v, if that is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Where the force acts, m, in the skin's axes.
    pub place_m: [f64; 3],
    /// Direction of the force on the body, of length 1.
    pub normal: [f64; 3],
    /// F, force on a body that does not move, N; negative for what has yet to come nearer.
    pub force_n: f64,
    /// k, N/m.
    pub stiffness_n_per_m: f64,
}

/// Columns whose normals are within 60° of their mean push as one.
const TOGETHER: f64 = 0.5;
/// Columns that push apart are told apart by the hardest of them: within 45° of its normal.
const BESIDE: f64 = 0.7;

/// Adds the springs that stand for `columns` under a body with the velocity of `posed`, and returns the normal force
/// that the columns have then, N. `lag_s` is Δt + τ.
///
/// A column at depth δ, over which the body moves at v along its normal at the end of the step, has the pressure f(e)
/// with e = δ − (Δt + τ) v: Euler's implicit method on a Kelvin–Voigt element. About the velocity of `posed`, where
/// e = e₀, that is f(e₀) + f′(e₀) (e − e₀). Columns that push the same way are a linear force and stiffness over a
/// plane, and three springs of equal stiffness have their sum, their first moments, and the second moments of the
/// stiffness: at √2 radii of gyration from its centre, 120° apart.
///
/// Of a body that does not touch but is within `near_m`, the first columns that it would touch have springs that push
/// once it has come that far.
pub(crate) fn of(
    law: &FoamLaw,
    columns: &[Column],
    posed: &PosedMesh<'_>,
    lag_s: f64,
    near_m: f64,
    out: &mut Vec<Support>,
) -> f64 {
    let mut pressed: Vec<Pressed> = Vec::with_capacity(columns.len());
    let mut deepest_m = f64::NEG_INFINITY;
    let after_m = |c: &Column| {
        let end_m = c.point_m - c.normal * c.depth_m;
        let arm = end_m - Vector::from(posed.centre_of_mass_m);
        (end_m, c.depth_m - lag_s * Vector::from(velocity_at(posed, arm.into())).dot(c.normal))
    };
    for c in columns {
        let (end_m, e) = after_m(c);
        deepest_m = deepest_m.max(e);
        let (p, slope) = law.pressure_and_slope(e);
        if p > 0.0 {
            pressed.push(Pressed::new(c, end_m, p, slope));
        }
    }
    if pressed.is_empty() && deepest_m > -near_m {
        // the first columns that would be touched, with the slope that they have then
        let slope = law.pressure_and_slope(f64::MIN_POSITIVE).1;
        let first = columns.iter().map(|c| (c, after_m(c))).filter(|(_, (_, e))| *e > deepest_m - 0.5 * near_m);
        pressed.extend(first.map(|(c, (end_m, e))| Pressed::new(c, end_m, slope * e, slope)));
    }
    let mut total_n = 0.0;
    while let Some(hardest) = pressed.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n)) {
        let mean = direction(&pressed);
        let (axis, limit) = if pressed.iter().all(|c| c.normal.dot(mean) >= TOGETHER) {
            (mean, f64::NEG_INFINITY)
        } else {
            (hardest.normal, BESIDE)
        };
        let (side, rest): (Vec<_>, Vec<_>) = pressed.into_iter().partition(|c| c.normal.dot(axis) >= limit);
        total_n += springs(&side, direction(&side), posed, lag_s, out).max(0.0);
        pressed = rest;
    }
    total_n
}

/// A column under pressure.
#[derive(Debug, Clone, Copy)]
struct Pressed {
    end_m: Vector,
    normal: Vector,
    area_m2: f64,
    /// At the velocity that is expected, N.
    force_n: f64,
    /// N/m.
    stiffness: f64,
}

impl Pressed {
    fn new(c: &Column, end_m: Vector, p: f64, slope: f64) -> Self {
        let (area_m2, normal) = (c.area_m2, c.normal);
        Self { end_m, normal, area_m2, force_n: area_m2 * p, stiffness: area_m2 * slope }
    }
}

/// Mean direction of the columns' forces, or of what they would be.
fn direction(columns: &[Pressed]) -> Vector {
    columns.iter().fold(Vector::ZERO, |sum, c| sum + c.normal * c.force_n.abs()).normalize_or_zero()
}

/// Three springs for columns that push along `normal`; their force at the expected velocity, N.
fn springs(columns: &[Pressed], normal: Vector, posed: &PosedMesh<'_>, lag_s: f64, out: &mut Vec<Support>) -> f64 {
    let (u, v) = (normal.any_orthonormal_vector(), normal.cross(normal.any_orthonormal_vector()));
    let shares = || columns.iter().map(|c| (c, c.normal.dot(normal)));
    let weights = || shares().map(|(c, share)| (c, share * share * c.stiffness));
    let stiffness: f64 = weights().map(|(_, k)| k).sum();
    let middle = weights().fold(Vector::ZERO, |sum, (c, k)| sum + c.end_m * k) / stiffness;
    let across = |c: &Pressed| [(c.end_m - middle).dot(u), (c.end_m - middle).dot(v)];
    // second moments; a column is as wide as its area
    let [mut uu, mut uv, mut vv] = [0.0; 3];
    for (c, k) in weights() {
        let ([x, y], own) = (across(c), c.area_m2 / 12.0);
        uu += k * (x * x + own);
        uv += k * x * y;
        vv += k * (y * y + own);
    }
    [uu, uv, vv] = [uu, uv, vv].map(|m| m / stiffness);
    let turn = 0.5 * (2.0 * uv).atan2(uu - vv);
    let (sin, cos) = turn.sin_cos();
    let (half, apart) = (0.5 * (uu + vv), (0.5 * (uu - vv)).hypot(uv));
    let (long_m, short_m) = ((half + apart).sqrt(), (half - apart).max(1e-6 * half).sqrt());
    let (long, short) = (u * cos + v * sin, v * cos - u * sin);
    // moments of the forces, in units of the radii of gyration
    let mut sums = [0.0; 3];
    for (c, share) in shares() {
        let away = c.end_m - middle;
        let at = [1.0, away.dot(long) / long_m, away.dot(short) / short_m];
        sums.iter_mut().zip(at).for_each(|(sum, at)| *sum += share * c.force_n * at);
    }
    // one of them where most of the force is
    let first = sums[2].atan2(sums[1]);
    for k in 0..3 {
        let (sin, cos) = (first + f64::from(k) * std::f64::consts::TAU / 3.0).sin_cos();
        let [x, y] = [cos, sin].map(|v| v * std::f64::consts::SQRT_2);
        let place = middle + long * (x * long_m) + short * (y * short_m);
        let arm = place - Vector::from(posed.centre_of_mass_m);
        let speed = Vector::from(velocity_at(posed, arm.into())).dot(normal);
        let force_n = (sums[0] + sums[1] * x + sums[2] * y + stiffness * lag_s * speed) / 3.0;
        out.push(Support { place_m: place.into(), normal: normal.into(), force_n, stiffness_n_per_m: stiffness / 3.0 });
    }
    sums[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foam::Foam;

    fn cup(axis_turn: f64) -> Vec<Column> {
        // an uneven patch on a cylinder of 30 mm
        let cell = |i: i32, j: i32| {
            let (angle, y) = (axis_turn + 0.03 * f64::from(i), 1e-3 * f64::from(j));
            let normal = Vector::new(angle.sin(), 0.0, angle.cos());
            let depth_m = 2e-3 - 1e-5 * f64::from(i * i + 2 * j * j + 3 * i - j);
            Column::new(0, normal * 0.03 + Vector::new(0.0, y, 0.0), normal, 0.9e-6, depth_m)
        };
        (-9..12).flat_map(|i| (-7..9).map(move |j| cell(i, j))).collect()
    }

    fn posed(mesh: &crate::mesh::TriMesh, velocity: [f64; 3], spin: [f64; 3]) -> PosedMesh<'_> {
        let at = PosedMesh::at_rest(mesh, [1e-3, 2e-3, 0.05]);
        PosedMesh { velocity_m_per_s: velocity, angular_velocity_rad_per_s: spin, ..at }
    }

    /// Normal force and its moments about the body's centre, of the columns themselves at a velocity of the body.
    fn exact(law: &FoamLaw, columns: &[Column], body: &PosedMesh<'_>, lag_s: f64) -> [Vector; 2] {
        let mut sums = [Vector::ZERO; 2];
        for c in columns {
            let arm = c.point_m - c.normal * c.depth_m - Vector::from(body.centre_of_mass_m);
            let e = c.depth_m - lag_s * Vector::from(velocity_at(body, arm.into())).dot(c.normal);
            let force = c.normal * (c.area_m2 * law.pressure_pa(e));
            sums[0] += force;
            sums[1] += arm.cross(force);
        }
        sums
    }

    fn of_springs(springs: &[Support], body: &PosedMesh<'_>, lag_s: f64) -> [Vector; 2] {
        let mut sums = [Vector::ZERO; 2];
        for s in springs {
            let (arm, normal) = (Vector::from(s.place_m) - Vector::from(body.centre_of_mass_m), Vector::from(s.normal));
            let v = Vector::from(velocity_at(body, arm.into())).dot(normal);
            let force = normal * (s.force_n - s.stiffness_n_per_m * lag_s * v);
            sums[0] += force;
            sums[1] += arm.cross(force);
        }
        sums
    }

    /// At the velocity that they are about, the springs have the columns' force and moments, at rest and moving; and
    /// so they do a little beside it on a flat patch, but for the columns' own width, 0.5 % of the slope against tilts.
    #[test]
    fn force_and_moments_and_their_slopes() {
        let law = Foam::default().law(f64::INFINITY);
        let mesh = crate::mesh::cuboid([0.1; 3]);
        let flat: Vec<Column> = cup(0.0)
            .iter()
            .map(|c| Column { normal: Vector::Z, point_m: Vector::new(c.point_m.x, c.point_m.y, 0.0), ..*c })
            .collect();
        for (velocity, spin) in [([0.0; 3], [0.0; 3]), ([0.0, 0.0, -0.3], [0.4, -0.2, 0.0])] {
            let lag_s = 2.5e-3;
            let body = posed(&mesh, velocity, spin);
            let mut springs = Vec::new();
            let force_n = of(&law, &flat, &body, lag_s, 0.0, &mut springs);
            assert_eq!(springs.len(), 3);
            let (wanted, found) = (exact(&law, &flat, &body, lag_s), of_springs(&springs, &body, lag_s));
            assert!((force_n / wanted[0].z - 1.0).abs() < 1e-12);
            assert!((found[0] - wanted[0]).length() < 1e-9 * force_n, "{found:?} {wanted:?}");
            // arms along z are those of the middle: no moment of a force along z has them
            assert!((found[1] - wanted[1]).length() < 1e-9 * force_n, "{found:?} {wanted:?}");
            for step in [[1e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 1e-5]] {
                let near = PosedMesh {
                    velocity_m_per_s: [velocity[0], velocity[1], velocity[2] + step[2]],
                    angular_velocity_rad_per_s: [spin[0] + step[0], spin[1] + step[1], spin[2]],
                    ..body
                };
                let (wanted_near, found_near) = (exact(&law, &flat, &near, lag_s), of_springs(&springs, &near, lag_s));
                for k in 0..2 {
                    let (change, wanted) = (found_near[k] - found[k], wanted_near[k] - wanted[k]);
                    assert!((change - wanted).length() < 6e-3 * wanted.length() + 1e-12, "{step:?}: {change} {wanted}");
                }
            }
        }
    }

    /// On a cylinder the force is along the pressures' sum, to the part of the columns' stiffness across it.
    #[test]
    fn a_curved_patch_pushes_along_its_mean() {
        let law = Foam::default().law(f64::INFINITY);
        let mesh = crate::mesh::cuboid([0.1; 3]);
        let body = posed(&mesh, [0.0; 3], [0.0; 3]);
        let mut springs = Vec::new();
        let columns = cup(0.4);
        of(&law, &columns, &body, 2.5e-3, 0.0, &mut springs);
        let (wanted, found) = (exact(&law, &columns, &body, 2.5e-3), of_springs(&springs, &body, 2.5e-3));
        assert!((found[0] - wanted[0]).length() < 1e-9 * wanted[0].length(), "{found:?} {wanted:?}");
        assert!((found[1] - wanted[1]).length() < 2e-3 * wanted[0].length() * 0.03, "{found:?} {wanted:?}");
    }

    /// Columns on opposite sides of a link, as in a fork, push apart: three springs a side. Nothing near pushes
    /// nothing.
    #[test]
    fn sides_are_told_apart() {
        let law = Foam::default().law(f64::INFINITY);
        let mesh = crate::mesh::cuboid([0.1; 3]);
        let body = posed(&mesh, [0.0; 3], [0.0; 3]);
        let mut columns = cup(0.0);
        columns.extend(cup(std::f64::consts::PI));
        let mut springs = Vec::new();
        let force_n = of(&law, &columns, &body, 2.5e-3, 0.0, &mut springs);
        assert_eq!(springs.len(), 6);
        assert!(of_springs(&springs, &body, 2.5e-3)[0].length() < 0.2 * force_n);
        springs.clear();
        let away: Vec<Column> = columns.iter().map(|c| Column { depth_m: -1e-3, ..*c }).collect();
        assert!(of(&law, &away, &body, 2.5e-3, 0.0, &mut springs) <= 0.0 && springs.is_empty());
        // what is near has springs that do not push yet
        assert!(of(&law, &away, &body, 2.5e-3, 2e-3, &mut springs) <= 0.0);
        assert!(!springs.is_empty() && springs.iter().all(|s| s.force_n < 0.0 && s.stiffness_n_per_m > 0.0));
    }
}
