//! Smooth random outlines, flat and rounded.

use crate::mesh::polygon;
use crate::shapes::dice::Dice;
use crate::shapes::outlines::{self, ROUND};
use crate::shapes::plan::{Dome, Plan};
use std::f64::consts::FRAC_PI_2;

/// A smooth random outline, like a pebble or a puddle.
pub(crate) fn blob(dice: &mut Dice) -> Plan {
    let waviness = dice.between(0.1, 0.32);
    let (outline, least) = outlines::blob(dice, waviness);
    Plan::simple(outline, 0.5 * least)
}

/// Part of a sphere or an ellipsoid, or a pebble, with its round side down; some have a flat middle.
pub(crate) fn dome(dice: &mut Dice) -> Plan {
    let outline = if dice.chance(0.65) {
        polygon::ellipse(1.0, dice.between(0.45, 1.0), ROUND)
    } else {
        let waviness = dice.between(0.03, 0.12);
        outlines::blob(dice, waviness).0
    };
    let cap_rad = dice.between(0.3, FRAC_PI_2);
    // the rise of a cap of a sphere over its width, higher or lower
    let rise = 0.5 * (0.5 * cap_rad).tan() * dice.between(0.6, 1.0);
    let flat = if dice.chance(0.3) { dice.between(0.1, 0.6) } else { 0.0 };
    let dome = Some(Dome { cap_rad, rise, flat });
    Plan {
        dome,
        ..Plan::simple(outline, 1.0)
    }
}
