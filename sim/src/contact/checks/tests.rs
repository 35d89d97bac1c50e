use super::*;
use crate::contact::{CONTACT_CHECKS, ContactField, PosedMesh, TaxelBins, WinklerConfig, WinklerLayer, conformance};
use crate::mesh::{TriMesh, cuboid, sphere};
use spts_models::SkinLayout;

fn relative_rms(a: &[f64], b: &[f64]) -> f64 {
    let d: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (d / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

#[test]
fn probe() {
    let skin = SkinLayout::default();
    for (name, build) in CONTACT_CHECKS {
        let t = std::time::Instant::now();
        let mut f = build(toml::Table::new(), &skin).unwrap();
        let mesh = cuboid([0.08, 0.06, 0.02]);
        let (lo, _) = mesh.bounds().unwrap();
        println!("{name} {:?}", lo);
        for d in [1e-4, 3e-4, 1e-3, 2e-3,3e-3] {
            let r = f.respond(&PosedMesh::at_rest(&mesh, [0.0, 0.0, -d - lo[2]]));
            println!("{d} {:?} expected {} {:?}", r.wrench.force_n, 1.5e7 * 0.0048 * d, t.elapsed());
            println!("{:?}", &r.pressure_pa[4 * r.pressure_pa.len() / 10..5*r.pressure_pa.len() / 10]);
        }
        println!("{:?} {:?}", conformance(*build), t.elapsed());
    }
    let mut w = WinklerLayer::new(WinklerConfig{thickness_m:10.0,cells_per_taxel:2,..Default::default()}, &skin).unwrap();
    let mut f = TaxelBed::new(TaxelBedConfig::default(), &skin).unwrap();
    let mesh = sphere(0.0334, 48, 96);
    let (lo, _) = mesh.bounds().unwrap();
    let pose=PosedMesh::at_rest(&mesh, [0.00313, -0.00171, -0.0036 - lo[2]]);
    let b=TaxelBins::new(&skin,2);
    let p=f.respond(&pose); let q=w.respond(&pose);
    println!("{:?} {:?}",p.wrench,q.wrench);
    println!("{}", relative_rms(b.cell_means(p.pressure_pa).values(), b.cell_means(q.pressure_pa).values()));
}
