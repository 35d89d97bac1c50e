//! The dynamics' contact field allocates nothing from step to step.
#![expect(unsafe_code, reason = "a global allocator that counts is unsafe to implement")]

use spts_contact::mesh::sphere;
use spts_contact::{ContactField as _, Foam, PosedMesh, WinklerLayer};
use spts_models::SkinLayout;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting what the thread asks of it.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // a thread that ends has no counter any more
    let _ = COUNT.try_with(|n| n.set(n.get() + 1));
}

// SAFETY: every call goes to `System` unchanged; counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise; `ptr` came from `System`.
        unsafe { System.dealloc(ptr, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise; `ptr` came from `System`.
        unsafe { System.realloc(ptr, layout, new_size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn counted(work: impl FnOnce()) -> u64 {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

/// A thousand answers to a ball that sinks, slides and turns, after one at the deepest pose.
#[test]
fn winkler_steps_without_allocating() {
    // the counter counts
    assert!(counted(|| drop(std::hint::black_box(vec![0_u8; 64]))) > 0);
    let mut field = WinklerLayer::new(Foam::default(), &SkinLayout::default()).unwrap();
    let ball = sphere(0.0334, 24, 48);
    let mut respond = |step: u32| {
        let t = f64::from(step) / 1000.0;
        let (s, c) = (0.3 * t).sin_cos();
        let body = PosedMesh {
            rotation: [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
            velocity_m_per_s: [0.1, -0.05, -1.0],
            angular_velocity_rad_per_s: [0.5, 1.0, 3.0],
            ..PosedMesh::at_rest(&ball, [0.02 * t, -0.01 * t, -4e-3 * t])
        };
        field.respond(&body).wrench.force_n[2]
    };
    let deepest_n = respond(1000);
    assert!(deepest_n > 1.0);
    let mut last_n = 0.0;
    let allocations = counted(|| {
        for step in 1..=1000 {
            last_n = respond(step);
        }
    });
    assert_eq!(allocations, 0);
    assert_eq!(last_n.to_bits(), deepest_n.to_bits());
}
