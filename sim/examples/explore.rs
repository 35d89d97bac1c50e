use spts_sim::{Scene, World, objects::OBJECTS, render, world::PressCourse};
use std::time::Instant;
fn main() {
    let what = std::env::args().nth(1).unwrap_or_default();
    if what == "press" {
        let only = std::env::args().nth(2);
        for o in OBJECTS {
            if only.as_ref().is_some_and(|n| n != o.name) {
                continue;
            }
            for k in 0..if only.is_some() { 10 } else { 10 } {
                let scene = match Scene::press(o.name) {
                    Ok(s) => s,
                    Err(e) => {
                        println!("{}: {e}", o.name);
                        continue;
                    }
                };
                let t = Instant::now();
                let mut w = match World::repeat(&scene, k) {
                    Ok(s) => s,
                    Err(e) => {
                        println!("{}: {e}", o.name);
                        continue;
                    }
                };
                let t0 = t.elapsed().as_secs_f64();
                let frames: Result<Vec<_>, _> = w.frames().collect();
                let frames = match frames {
                    Ok(f) => f,
                    Err(e) => {
                        println!("{}: {e}", o.name);
                        continue;
                    }
                };
                let c = PressCourse::of(&frames, 20.0, [0.778, 1.011], 15e-3 * 15e-3);
                println!(
                    "{:8} tris {:5} setup {:.3} s run {:.3} s {:?}",
                    o.name,
                    scene.mesh().triangles.len(),
                    t0,
                    t.elapsed().as_secs_f64() - t0,
                    c.map(|c| format!(
                        "on {:.3} rise {:.3} plateau {:.3} err {:.3} over {:.4} lift {:.3} fall {:.3} imb {:.1e}",
                        c.onset_s,
                        c.rise_s,
                        c.plateau_n,
                        c.plateau_error_n,
                        c.overshoot,
                        c.lift_s,
                        c.fall_s,
                        c.imbalance
                    ))
                );
                if std::env::args().nth(3).is_some() {
                    for f in frames.iter().step_by(10) {
                        println!("{:.3} {:.3}", f.time_s, f.wrench.force_n[2]);
                    }
                }
            }
        }
    } else if what == "drop" {
        let scene = Scene::bounce().unwrap();
        for k in 0..3 {
            let t = Instant::now();
            let mut w = World::repeat(&scene, k).unwrap();
            let n = w.frames().map(|f| f.unwrap()).count();
            println!("frames {n} {:.3} s", t.elapsed().as_secs_f64());
            for b in w.bounces() {
                println!(
                    "{:.4} contact {:.2} ms cor {:.3} vin {:.3} peak {:.1} lost {:.5} work {:.5}",
                    b.start_s,
                    b.contact_s * 1e3,
                    b.restitution(),
                    b.speed_in_m_per_s,
                    b.peak_force_n,
                    b.lost_j,
                    b.work_j
                );
            }
        }
    } else {
        let scene = if what == "ball" {
            Scene::bounce().unwrap()
        } else {
            Scene::press(&what).unwrap()
        };
        let mut w = World::new(&scene).unwrap();
        let mut last = None;
        let stop = if what == "ball" { 0.442 } else { 0.9 };
        for f in w.frames() {
            let f = f.unwrap();
            let t = f.time_s;
            last = Some(f);
            if t > stop {
                break;
            }
        }
        let f = last.unwrap();
        let full = f.pressure.max().max(1.0);
        let t = Instant::now();
        render::render_png(
            &w,
            render::Camera::Wide,
            Some((&f, full)),
            [1280, 960],
            "/tmp/world_wide.png",
        )
        .unwrap();
        render::render_png(
            &w,
            render::Camera::Close,
            Some((&f, full)),
            [1280, 960],
            "/tmp/world_close.png",
        )
        .unwrap();
        println!("{:.3} s", t.elapsed().as_secs_f64());
    }
}
