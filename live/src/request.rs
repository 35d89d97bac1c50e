//! What a page asks for.

use crate::error::LiveError;
use crate::mesh::MeshUnit;
use crate::object::Side;
use serde::Deserialize;

/// Longest message of text, bytes.
pub(crate) const MOST_TEXT_BYTES: usize = 4096;

/// A message of the page.
///
/// ```
/// use spts_live::Request;
///
/// let request = Request::from_json(r#"{"type": "press", "x_mm": 3, "y_mm": -20.5, "force_n": 12}"#);
/// assert!(matches!(request, Ok(Request::Press { force_n, .. }) if force_n > 11.0));
/// assert!(Request::from_json("{\"type\": \"shout\"}").is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// Presses here and so hard from now on.
    Press {
        /// Place of the object's middle, mm to the right of the skin's middle.
        x_mm: f64,
        /// Place of the object's middle, mm above the skin's middle as the page shows it: towards row 0.
        y_mm: f64,
        /// Force, N; 0 lifts the object.
        force_n: f64,
    },
    /// Takes another object.
    Object {
        /// Its name.
        name: String,
    },
    /// Turns the object.
    Turn {
        /// Angle about the skin's normal, degrees, counter-clockwise.
        degrees: f64,
    },
    /// Takes so many measurements an image.
    Measurements {
        /// M.
        count: usize,
    },
    /// Chooses decoder and rows of a panel.
    Panel {
        /// 0 or 1.
        panel: usize,
        /// Name of the decoder.
        decoder: String,
        /// Name of the rows.
        rows: String,
    },
    /// Chooses the electronics.
    Readout {
        /// Name of the profile.
        profile: String,
        /// What its noise is multiplied with.
        noise: f64,
    },
    /// Breaks or mends a cell.
    Fault {
        /// Taxel of the cell, row by row from 0.
        taxel: u32,
        /// Name of the fault; none mends the cell.
        name: Option<String>,
    },
    /// Mends all cells.
    MendAll,
    /// Says what the next message of bytes is: a mesh.
    Mesh {
        /// Name of the file; its ending says the format.
        name: String,
        /// Unit of the file.
        unit: MeshUnit,
    },
    /// Turns the mesh that was dropped onto another side.
    Side {
        /// Side that touches the skin.
        side: Side,
    },
}

impl Request {
    /// Reads a message.
    ///
    /// # Errors
    /// [`LiveError::Message`] for what is too long, no JSON, or no request.
    pub fn from_json(text: &str) -> Result<Self, LiveError> {
        if text.len() > MOST_TEXT_BYTES {
            let found = text.len();
            return Err(LiveError::Message(format!(
                "its length = {found} bytes is outside [0, {MOST_TEXT_BYTES}]"
            )));
        }
        serde_json::from_str(text).map_err(|e| LiveError::Message(e.to_string()))
    }
}
