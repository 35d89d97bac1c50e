//! Times a decision of the evidence classifier, 17 classes on 10 × 10 taxels and, with `open`, the unknown, and prints
//! the times as a line of JSON.
//!
//! ```text
//! evidence_time M REPEATS [open]
//! ```
//!
//! Every window has its own ±1 rows. Smallest of `REPEATS` times of 200 windows each, µs a window, on one thread:
//! `form` (Φ·bank by look-up), `prepare` (form, and gains: everything that needs no sample), `samples` (all M samples
//! to the decision, rows prepared), `last` (the last sample to the decision, and a copy of the evidence before it),
//! `all` (everything), `anytime` (everything, with a decision after every sample), `image` (the image that goes with a
//! decision).

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{
    AnytimeClassifier, Evidence, EvidenceClassifier, ImageEstimator, Library, Posterior, Preparation, TemplateModel,
};
use spts_recon::{AmplitudeRange, Matrix, SignTables, Workspace};
use std::error::Error;
use std::hint::black_box;
use std::io::Write as _;
use std::time::Instant;

/// Rows and columns of the sheet.
const SIDE: usize = 10;

/// Words of signs a row.
const WORDS: usize = (SIDE * SIDE).div_ceil(64);

/// Windows timed at once.
const WINDOWS: usize = 200;

type Outcome = Result<(), Box<dyn Error>>;

struct Setup {
    m: usize,
    classifier: EvidenceClassifier,
    images: ImageEstimator,
    signs: Vec<u64>,
    y: Vec<f64>,
}

impl Setup {
    fn new(m: usize, open: bool) -> Result<Self, Box<dyn Error>> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let images = (0..SIDE * SIDE * 17)
            .map(|_| rng.random_range(0.0_f64..1.0).powi(4))
            .collect();
        let images = Matrix::from_rows(SIDE * SIDE, 17, images)?;
        let library = Library::new(&images, &(0..17).collect::<Vec<_>>())?;
        let model = if open {
            TemplateModel::open(SIDE)
        } else {
            TemplateModel::new(SIDE)
        };
        let (mut components, mut priors) = (model.classes(&library)?, model.image_priors(&library)?);
        if open {
            components.push(model.unknown(&library)?);
            priors.push(model.unknown_prior(&library)?);
        }
        let signs: Vec<u64> = (0..WINDOWS * m * WORDS).map(|_| rng.random()).collect();
        let rows = signs.chunks_exact(WORDS).enumerate();
        let y = rows.map(|(r, signs)| {
            let image = images.column(r / m % 17);
            let terms = image.iter().enumerate();
            let signal: f64 = terms.map(|(i, v)| if sign(signs, i) { *v } else { -v }).sum();
            signal + rng.random_range(-0.3..0.3)
        });
        Ok(Self {
            m,
            y: y.collect(),
            classifier: EvidenceClassifier::new(&components, AmplitudeRange::new(0.2, 6.0)?, 0.05)?,
            images: ImageEstimator::new(priors, 0.2)?,
            signs,
        })
    }

    fn signs(&self, window: usize) -> &[u64] {
        &self.signs[window * self.m * WORDS..(window + 1) * self.m * WORDS]
    }

    fn y(&self, window: usize) -> &[f64] {
        &self.y[window * self.m..(window + 1) * self.m]
    }
}

fn sign(signs: &[u64], taxel: usize) -> bool {
    signs[taxel / 64] >> (taxel % 64) & 1 == 1
}

/// Smallest time of `repeats` runs of `each` on all windows, µs a window.
fn best(repeats: usize, mut each: impl FnMut(usize) -> Outcome) -> Result<f64, Box<dyn Error>> {
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let begin = Instant::now();
        (0..WINDOWS).try_for_each(&mut each)?;
        let each_us = begin.elapsed().as_secs_f64() * 1e6 / WINDOWS as f64;
        least = least.min(each_us);
    }
    Ok(least)
}

fn push_rows(preparation: &mut Preparation, rows: &[f64], columns: usize) -> Outcome {
    preparation.clear();
    for row in rows.chunks_exact(columns) {
        preparation.push(row)?;
    }
    Ok(())
}

fn observe(evidence: &mut Evidence, preparation: &Preparation, y: &[f64]) -> Outcome {
    for y in black_box(y) {
        evidence.observe(preparation, *y)?;
    }
    Ok(())
}

fn main() -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (m, repeats, open) = match &*arguments {
        [m, repeats] => (m, repeats, false),
        [m, repeats, open] if open == "open" => (m, repeats, true),
        _ => return Err("usage: evidence_time M REPEATS [open]".into()),
    };
    let (m, repeats): (usize, usize) = (m.parse()?, repeats.parse()?);
    let setup = Setup::new(m.max(1), open)?;
    let classifier = &setup.classifier;
    let (tables, columns) = (
        SignTables::<f32>::new(classifier.bank().view()),
        classifier.bank().ncols(),
    );
    let (mut rows, mut posterior) = (vec![0.0; setup.m * columns], Posterior::default());
    let mut preparation = classifier.preparation();
    let form = best(repeats, |w| {
        tables.fill_rows(black_box(setup.signs(w)), &mut rows);
        black_box(&rows);
        Ok(())
    })?;
    let prepare = best(repeats, |w| {
        tables.fill_rows(black_box(setup.signs(w)), &mut rows);
        push_rows(&mut preparation, &rows, columns)
    })?;
    let mut prepared = Vec::new();
    for w in 0..WINDOWS {
        tables.fill_rows(setup.signs(w), &mut rows);
        push_rows(&mut preparation, &rows, columns)?;
        prepared.push(preparation.clone());
    }
    let mut evidence = classifier.evidence();
    let samples = best(repeats, |w| {
        evidence.clear();
        observe(&mut evidence, &prepared[w], setup.y(w))?;
        black_box(classifier.decide(&prepared[w], &evidence, &mut posterior));
        Ok(())
    })?;
    let mut before = Vec::new();
    for (w, preparation) in prepared.iter().enumerate() {
        evidence.clear();
        observe(&mut evidence, preparation, &setup.y(w)[..setup.m - 1])?;
        before.push(evidence.clone());
    }
    let last = best(repeats, |w| {
        let mut evidence = before[w].clone();
        observe(&mut evidence, &prepared[w], &setup.y(w)[setup.m - 1..])?;
        black_box(classifier.decide(&prepared[w], &evidence, &mut posterior));
        Ok(())
    })?;
    let all = best(repeats, |w| {
        tables.fill_rows(black_box(setup.signs(w)), &mut rows);
        push_rows(&mut preparation, &rows, columns)?;
        evidence.clear();
        observe(&mut evidence, &preparation, setup.y(w))?;
        black_box(classifier.decide(&preparation, &evidence, &mut posterior));
        Ok(())
    })?;
    let mut stream = AnytimeClassifier::new(classifier.clone());
    let anytime = best(repeats, |w| {
        stream.clear();
        for (signs, y) in setup.signs(w).chunks_exact(WORDS).zip(black_box(setup.y(w))) {
            black_box(stream.push(signs, *y)?);
        }
        Ok(())
    })?;
    let (mut image, mut work) = (vec![0.0; SIDE * SIDE], Workspace::default());
    let taxels = |w: usize| {
        let rows = setup.signs(w).chunks_exact(WORDS);
        let weights = rows.flat_map(|r| (0..SIDE * SIDE).map(move |i| if sign(r, i) { 1.0 } else { -1.0 }));
        Matrix::from_rows(setup.m, SIDE * SIDE, weights.collect())
    };
    let phi = (0..WINDOWS).map(taxels).collect::<Result<Vec<_>, _>>()?;
    let image_us = best(repeats, |w| {
        Ok(setup
            .images
            .estimate(&posterior, phi[w].view(), setup.y(w), &mut work, &mut image)?)
    })?;
    writeln!(
        std::io::stdout(),
        "{{\"m\": {m}, \"form\": {form:.3}, \"prepare\": {prepare:.3}, \"samples\": {samples:.3}, \"last\": {last:.3}, \"all\": {all:.3}, \
         \"anytime\": {anytime:.3}, \"image\": {image_us:.3}}}"
    )?;
    Ok(())
}
