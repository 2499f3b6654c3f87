//! Second-order sections along a single series; `compare` has those of sixteen vehicles side by side.

/// The series behind all sections [b0, b1, b2, 1, a1, a2] in the transposed form II, each with what it remembers.
pub fn pass(sections: &[[f64; 6]], memory: &mut [[f64; 2]], series: &mut [f64]) {
    for x in series {
        for ([b0, b1, b2, _, a1, a2], [m0, m1]) in sections.iter().zip(&mut *memory) {
            let y = b0 * *x + *m0;
            (*m0, *m1) = (b1 * *x - a1 * y + *m1, b2 * *x - a2 * y);
            *x = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_of_one_pole_forgets_by_its_pole_and_remembers_where_it_stood() {
        // y_k = x_k + y_(k-1)/2: from rest 1, 1/2, 1/4; in the steady state of x = 1, where y = 2, it stays there
        let section = [[1.0, 0.0, 0.0, 1.0, -0.5, 0.0]];
        let (mut struck, mut steady) = ([1.0, 0.0, 0.0], [1.0; 3]);
        pass(&section, &mut [[0.0; 2]], &mut struck);
        pass(&section, &mut [[1.0, 0.0]], &mut steady);
        assert_eq!((struck, steady), ([1.0, 0.5, 0.25], [2.0; 3]));
    }
}
