//! The trained network of the decoder `amortised`: the one that is built into the program, or one from a file.

use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::recover::{Layer, Unrolled, UnrolledStep, UnrolledWeights};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// The network that ships, for the published skin; `python -m spts.amortised` trains it.
const SHIPPED: &[u8] = include_bytes!("../../assets/amortised.safetensors");
/// Largest file of a network, bytes.
const LARGEST: u64 = 1 << 30;
/// What files say that they are.
const KIND: &str = "spts amortised 1";

/// A network, and the grid for which it was trained.
///
/// ```
/// use spts_eval::training::TrainedNetwork;
///
/// let network = TrainedNetwork::shipped();
/// assert!(network.on([10, 10]).is_ok());
/// let error = network.on([12, 20]).err().expect("another sheet");
/// assert!(error.to_string().contains("`amortised` is trained for 10 × 10 taxels"));
/// ```
#[derive(Debug, Clone)]
pub struct TrainedNetwork {
    /// Rows and columns of the sheet.
    pub shape: [usize; 2],
    /// The network.
    pub network: Arc<Unrolled>,
}

impl TrainedNetwork {
    /// The network shipped with the program, for the published skin of 10 × 10 taxels.
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
        let told: serde_json::Value = serde_json::from_str(told).map_err(|e| failed(e.to_string()))?;
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| failed(e.to_string()))?;
        let file = File { told: &told, tensors };
        let read = || -> Result<_, String> {
            if file.told["kind"] != KIND {
                return Err(format!("`kind` is {}, expected {KIND:?}", file.told["kind"]));
            }
            let shape = [file.count("rows")?, file.count("cols")?];
            let steps = file.count("unrolled")?;
            let taxels = shape[0].saturating_mul(shape[1]);
            let prior = file.values("prior", &[taxels, taxels])?;
            let prior = Matrix::from_rows(taxels, taxels, prior.iter().map(|v| f64::from(*v)).collect())
                .map_err(|e| format!("`prior`: {e}"))?;
            let step = |t: usize| -> Result<UnrolledStep, String> {
                Ok(UnrolledStep {
                    hidden: file.layer(&format!("steps.{t}.w1"), &format!("steps.{t}.b1"))?,
                    change: file.layer(&format!("steps.{t}.w2"), &format!("steps.{t}.b2"))?,
                })
            };
            let steps: Vec<UnrolledStep> = (0..steps).map(step).collect::<Result<_, _>>()?;
            let output = file.layer("out.w", "out.b")?;
            let (found, known) = (file.tensors.len(), 3 + 4 * steps.len());
            if found != known {
                return Err(format!("{found} tensors; a network with `unrolled` = {} has {known}", steps.len()));
            }
            Ok((shape, UnrolledWeights::new(prior, file.number("noise_variance")?, steps, output)))
        };
        let (shape, weights) = read().map_err(failed)?;
        let weights = weights.map_err(|e| e.at(path.display()))?;
        Ok(Self { shape, network: Arc::new(Unrolled::new(weights)) })
    }

    /// The network, for a sheet with `skin` rows and columns.
    ///
    /// # Errors
    /// [`Refusal`] if it is for another sheet.
    pub fn on(&self, skin: [usize; 2]) -> Result<Arc<Unrolled>, Refusal> {
        if self.shape == skin {
            Ok(Arc::clone(&self.network))
        } else {
            let [[rows, cols], [own_rows, own_cols]] = [self.shape, skin];
            Err(Refusal::new(format!(
                "`amortised` is trained for {rows} × {cols} taxels, and the skin has {own_rows} × {own_cols}: train a \
                 network for it (`python -m spts.amortised --help`) and name its file with `--weights`"
            )))
        }
    }
}

struct File<'a> {
    told: &'a serde_json::Value,
    tensors: SafeTensors<'a>,
}

impl File<'_> {
    fn number(&self, field: &str) -> Result<f64, String> {
        let found = &self.told[field];
        found.as_f64().ok_or_else(|| format!("`{field}` is {found}, expected a number"))
    }

    /// A whole number in [0, 10000].
    fn count(&self, field: &str) -> Result<usize, String> {
        let found = self.told[field].as_u64().filter(|count| *count <= 10_000);
        let found = found.and_then(|count| usize::try_from(count).ok());
        found.ok_or_else(|| format!("`{field}` is {}, expected a whole number in [0, 10000]", self.told[field]))
    }

    /// The numbers of the tensor `name`, which has this shape.
    fn values(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, String> {
        let tensor = self.tensors.tensor(name).map_err(|e| format!("`{name}`: {e}"))?;
        if tensor.shape() != shape {
            return Err(format!("`{name}` has the shape {:?}, expected {shape:?}", tensor.shape()));
        }
        numbers(&tensor)
            .ok_or_else(|| format!("`{name}` has numbers of the type {:?}, expected F16 or F32", tensor.dtype()))
    }

    /// A layer of inputs × outputs weights, and a bias for each output.
    fn layer(&self, weights: &str, bias: &str) -> Result<Layer, String> {
        let length = |name: &str, side: usize| -> Result<usize, String> {
            let tensor = self.tensors.tensor(name).map_err(|e| format!("`{name}`: {e}"))?;
            Ok(tensor.shape().get(side).copied().unwrap_or_default())
        };
        let (inputs, outputs) = (length(weights, 0)?, length(bias, 0)?);
        Ok(Layer::new(self.values(weights, &[inputs, outputs])?, self.values(bias, &[outputs])?))
    }
}

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
    fn the_weights_that_ship_are_for_the_published_skin() {
        assert_eq!(TrainedNetwork::shipped().shape, [10, 10]);
        let refused = TrainedNetwork::shipped().on([12, 20]).unwrap_err();
        assert!(refused.to_string().contains("the skin has 12 × 20"), "{refused}");
    }

    /// A transposed tensor has as many numbers, and so has a network that is said to have fewer steps.
    #[test]
    fn shapes_and_counts_of_weights_are_checked() {
        for (from, to, said) in [
            ("[450,160]", "[160,450]", "`steps.0.w1` has the shape [160, 450], expected [160, 160]"),
            ("[148,100]", "[100,148]", "`out.w` has the shape [100, 148], expected [100, 100]"),
            ("[100,100]", "[50,200]", "`prior` has the shape [50, 200], expected [100, 100]"),
            ("\\\"unrolled\\\": 3", "\\\"unrolled\\\": 1", "15 tensors; a network with `unrolled` = 1 has 7"),
        ] {
            let header = 8 + usize::try_from(u64::from_le_bytes(SHIPPED[..8].try_into().unwrap())).unwrap();
            let text = std::str::from_utf8(&SHIPPED[8..header]).unwrap();
            let mut changed = text.replacen(from, to, 1);
            assert!(changed != text, "{from} is not in {text}");
            changed.extend(std::iter::repeat_n(' ', text.len() - changed.len()));
            let bytes = [&SHIPPED[..8], changed.as_bytes(), &SHIPPED[header..]].concat();
            let refused = TrainedNetwork::parse(&bytes, Path::new("w")).unwrap_err().to_string();
            assert!(refused.contains(said), "{refused}");
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
