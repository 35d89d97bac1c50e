//! The trained network of the decoder `amortised`: the one that is built into the program, or one from a file.

use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::Deserialize;
use spts_input::Refusal;
use spts_recon::recover::{Unrolled, UnrolledBlock, UnrolledWeights};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// The network that ships; `python -m spts.amortised` trains it.
const SHIPPED: &[u8] = include_bytes!("../../assets/amortised.safetensors");
/// Largest file of a network, bytes.
const LARGEST: u64 = 1 << 30;
/// What files say that they are.
const KIND: &str = "spts amortised 2";

/// A network with weights that are shared over the grid, for sheets of any rows and columns.
///
/// ```
/// use spts_eval::training::TrainedNetwork;
///
/// let network = TrainedNetwork::shipped();
/// assert_eq!(network.on([12, 20])?.taxels(), 240);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct TrainedNetwork {
    weights: Arc<UnrolledWeights>,
}

impl TrainedNetwork {
    /// The network shipped with the program.
    ///
    /// # Panics
    /// Never: a test reads it.
    pub fn shipped() -> Self {
        static NETWORK: LazyLock<TrainedNetwork> = LazyLock::new(|| {
            let path = Path::new("amortised.safetensors");
            TrainedNetwork::parse(SHIPPED, path).unwrap_or_else(|e| panic!("the weights that ship: {e}"))
        });
        NETWORK.clone()
    }

    /// Reads a network from the file at `path`, as written by `python -m spts.amortised`.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be read, or holds no such network.
    pub fn open(path: &Path) -> Result<Self, Refusal> {
        let bytes = spts_input::read(path, LARGEST).map_err(Refusal::in_file(path))?;
        Self::parse(&bytes, path)
    }

    fn parse(bytes: &[u8], path: &Path) -> Result<Self, Refusal> {
        let failed = |reason: String| {
            let path = path.display();
            Refusal::new(format!("{path}: not a trained network in safetensors format: {reason}"))
        };
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| failed(e.to_string()))?;
        let told = metadata.metadata().as_ref().and_then(|all| all.get("spts")).map_or("{}", String::as_str);
        let told: serde_json::Value = serde_json::from_str(told).map_err(|e| failed(format!("`spts`: {e}")))?;
        if told["kind"] != KIND {
            return Err(failed(format!("`kind` is {}, expected {KIND:?}", told["kind"])));
        }
        let told: Told = serde_json::from_value(told).map_err(|e| failed(format!("`spts`: {e}")))?;
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| failed(e.to_string()))?;
        let expected = told.blocks.saturating_mul(NAMES.len());
        if tensors.len() != expected {
            let found = tensors.len();
            return Err(failed(format!("{found} tensors; a network with `blocks` = {} has {expected}", told.blocks)));
        }
        let block = |t: usize| -> Result<UnrolledBlock, String> {
            let mut block = UnrolledBlock::default();
            let length = |name: &str| {
                let bias = tensors.tensor(&format!("blocks.{t}.{name}"));
                bias.map_or(0, |bias| bias.shape().iter().product::<usize>())
            };
            let (channels, outputs) = (length("b1"), length("b3"));
            for (name, field) in NAMES {
                let last = match name {
                    "w1" | "g1" | "dw" => Some(channels),
                    "w3" => Some(outputs),
                    _ => None,
                };
                let name = format!("blocks.{t}.{name}");
                let tensor = tensors.tensor(&name).map_err(|e| format!("`{name}`: {e}"))?;
                // a transposed tensor has as many numbers
                if last.is_some_and(|last| tensor.shape().last() != Some(&last)) {
                    let expected = last.unwrap_or_default();
                    return Err(format!("`{name}` has the shape {:?}, expected {expected} columns", tensor.shape()));
                }
                *field(&mut block) = numbers(&tensor).ok_or_else(|| {
                    format!("`{name}` has numbers of the type {:?}, expected F16 or F32", tensor.dtype())
                })?;
            }
            Ok(block)
        };
        let blocks = (0..told.blocks).map(block).collect::<Result<Vec<_>, String>>().map_err(failed)?;
        let weights = UnrolledWeights::new(told.widths, told.priors, told.noise_variance, blocks);
        Ok(Self { weights: Arc::new(weights.map_err(|e| e.at(path.display()))?) })
    }

    /// The network, for a sheet with `shape` rows and columns.
    ///
    /// # Errors
    /// [`Refusal`] if there is no such sheet.
    pub fn on(&self, shape: [usize; 2]) -> Result<Unrolled, Refusal> {
        Unrolled::new(Arc::clone(&self.weights), shape)
    }
}

/// What a file says of its network, beside the numbers.
#[derive(Debug, Deserialize)]
struct Told {
    blocks: usize,
    widths: [f64; 2],
    priors: Vec<[f64; 4]>,
    noise_variance: f64,
}

type Field = fn(&mut UnrolledBlock) -> &mut Vec<f32>;

/// Tensors of a block by name.
const NAMES: [(&str, Field); 8] = [
    ("w1", |b| &mut b.taxel),
    ("g1", |b| &mut b.whole),
    ("b1", |b| &mut b.bias),
    ("dw", |b| &mut b.near),
    ("b2", |b| &mut b.near_bias),
    ("w3", |b| &mut b.output),
    ("b3", |b| &mut b.output_bias),
    ("nu", |b| &mut b.noise),
];

/// Half or single precision, little endian.
fn numbers(tensor: &TensorView<'_>) -> Option<Vec<f32>> {
    let bytes = tensor.data();
    match tensor.dtype() {
        Dtype::F16 => Some(bytes.as_chunks().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect()),
        Dtype::F32 => Some(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_that_ships_serves_every_sheet() {
        for shape in [[10, 10], [6, 6], [12, 20], [64, 64]] {
            assert_eq!(TrainedNetwork::shipped().on(shape).unwrap().taxels(), shape[0] * shape[1]);
        }
        assert!(TrainedNetwork::shipped().on([0, 7]).is_err());
    }

    /// A transposed tensor has as many numbers.
    #[test]
    fn shapes_of_weights_are_checked() {
        let header = 8 + usize::try_from(u64::from_le_bytes(SHIPPED[..8].try_into().unwrap())).unwrap();
        let text = std::str::from_utf8(&SHIPPED[8..header]).unwrap();
        for (from, to) in [("[25,24]", "[24,25]"), ("[24,16]", "[16,24]"), ("[9,24]", "[24,9]")] {
            let changed = text.replacen(from, to, 1);
            assert!(changed != text, "{from} is not in {text}");
            let bytes = [&SHIPPED[..8], changed.as_bytes(), &SHIPPED[header..]].concat();
            let refused = TrainedNetwork::parse(&bytes, Path::new("w")).unwrap_err().to_string();
            assert!(refused.contains("columns"), "{refused}");
        }
    }

    #[test]
    fn damaged_weights_are_refused() {
        for end in [0, 7, 200, SHIPPED.len() - 1] {
            assert!(TrainedNetwork::parse(&SHIPPED[..end], Path::new("w")).is_err(), "{end} bytes");
        }
        let mut other = SHIPPED.to_vec();
        let at = other.windows(KIND.len()).position(|w| w == KIND.as_bytes()).unwrap();
        other[at] = b'x';
        let refused = TrainedNetwork::parse(&other, Path::new("w")).unwrap_err();
        assert!(refused.to_string().contains("`kind`"), "{refused}");
    }
}
