//! Parallel processing of images, limited by threads and by total pixels.

use std::sync::{Condvar, Mutex, MutexGuard};

use rayon::ThreadPool;

use deltille::frames::Frame;
use deltille::limits::Limits;

/// Calls a function with each frame and its index, on the threads of a pool. Images in memory together have no more
/// pixels than the limit for one.
pub fn for_each(
    pool: &ThreadPool,
    limits: &Limits,
    frames: impl Iterator<Item = anyhow::Result<Frame>> + Send,
    work: impl Fn(usize, anyhow::Result<Frame>) + Sync,
) {
    let frames = Mutex::new(frames.enumerate());
    let memory = Memory { most: limits.max_pixels, used: Mutex::default(), freed: Condvar::new() };
    // The threads of the pool never wait for memory: a waiting thread would delay other images,
    // because each thread also works on parts of these.
    std::thread::scope(|scope| {
        for _ in 0..pool.current_num_threads() {
            scope.spawn(|| {
                loop {
                    let next = frames.lock().expect("no iterator panics").next();
                    let Some((index, frame)) = next else { return };
                    let pixels = frame.as_ref().ok().and_then(|frame| frame.pixels(limits));
                    let _taken = memory.take(pixels.unwrap_or(limits.max_pixels));
                    pool.install(|| work(index, frame));
                }
            });
        }
    });
}

/// Budget of pixels in memory.
struct Memory {
    most: u64,
    used: Mutex<u64>,
    freed: Condvar,
}

/// A share of the budget, released when dropped.
struct Taken<'a> {
    memory: &'a Memory,
    pixels: u64,
}

impl Memory {
    /// Waits until this many pixels, or all of a smaller budget, are free, and takes them.
    fn take(&self, pixels: u64) -> Taken<'_> {
        let pixels = pixels.min(self.most);
        let is_short = |used: &mut u64| *used > self.most - pixels;
        let used = self.freed.wait_while(self.used(), is_short);
        *used.expect("no thread panics here") += pixels;
        Taken { memory: self, pixels }
    }

    fn used(&self) -> MutexGuard<'_, u64> {
        self.used.lock().expect("no thread panics here")
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *self.memory.used() -= self.pixels;
        self.memory.freed.notify_all();
    }
}
