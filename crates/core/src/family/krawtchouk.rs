//! Exact Krawtchouk polynomials.

/// Returns K_k(i) for length n ≤ 65: the coefficient of z^k in (1−z)^i (1+z)^(n−i).
pub(super) fn krawtchouk(n: u32, k: u32, i: u32) -> i128 {
    (0..=k.min(i))
        .filter(|&j| k - j <= n - i)
        .map(|j| {
            let sign = if j % 2 == 0 { 1 } else { -1 };
            sign * binomial(i, j) * binomial(n - i, k - j)
        })
        .sum()
}

pub(super) fn binomial(n: u32, k: u32) -> i128 {
    (0..k).fold(1, |b, i| b * i128::from(n - i) / i128::from(i + 1))
}
