//! Samples of several contexts as rows (x, task), and the factor of the task matrix.

use faer::{Mat, mat};
use mtgp::prior::TaskMatrix;
use mtgp::{Stacked, TaskCovariance, TaskFactor, with_task};
use proptest::prelude::*;

fn x() -> Mat<f64> {
    mat![
        [1.0, 2.0, 3.0],
        [0.0, 5.0, 6.0],
        [1.0, 2.0, 3.0],
        [7.0, 8.0, 9.0],
        [-0.0, 5.0, 6.0],
    ]
}

#[test]
fn samples_are_sorted_by_task_and_keep_their_order() {
    let data = Stacked::new(x().as_ref(), &[2, 0, 1, 0, 1], 3).unwrap();
    assert_eq!(data.order(), [1, 3, 2, 4, 0]);
    assert_eq!(data.tasks(), [0, 0, 1, 1, 2]);
    assert_eq!(data.counts(), [2, 2, 1]);
    assert_eq!(data.n_tasks(), 3);
    assert_eq!(data.inputs().row(1), mat![[7.0, 8.0, 9.0, 0.0]].row(0));
    assert_eq!(data.inputs().row(4), mat![[1.0, 2.0, 3.0, 2.0]].row(0));
    assert_eq!(
        data.stack(&[10.0, 11.0, 12.0, 13.0, 14.0]),
        [11.0, 13.0, 12.0, 14.0, 10.0]
    );
    let task = with_task(x().subrows(3, 1), 2);
    assert_eq!(task, mat![[7.0, 8.0, 9.0, 2.0]]);
}

#[test]
fn distinct_inputs_are_found_over_all_tasks() {
    // Rows by task: samples 1, 3, 2, 4, 0, of which 1 and 4 (0 = −0) and 2 and 0 agree.
    let data = Stacked::new(x().as_ref(), &[2, 0, 1, 0, 1], 3).unwrap();
    let (distinct, number) = data.unique_inputs();
    assert_eq!(number, [0, 1, 2, 0, 2]);
    assert_eq!(
        distinct,
        mat![[0.0, 5.0, 6.0], [7.0, 8.0, 9.0], [1.0, 2.0, 3.0]]
    );
}

proptest! {
    #[test]
    fn distinct_inputs_give_back_every_row(
        values in prop::collection::vec((0_u8..3, 0_u8..2, 0_usize..4), 4..60)
    ) {
        let x = Mat::from_fn(values.len(), 2, |row, col| {
            f64::from(if col == 0 { values[row].0 } else { values[row].1 })
        });
        let mut tasks: Vec<usize> = values.iter().map(|value| value.2).collect();
        tasks[..4].copy_from_slice(&[0, 1, 2, 3]);
        let data = Stacked::new(x.as_ref(), &tasks, 4).unwrap();
        let (distinct, number) = data.unique_inputs();
        for (row, &which) in number.iter().enumerate() {
            prop_assert_eq!(distinct.row(which), data.covariates().row(row));
        }
        for a in 0..distinct.nrows() {
            for b in 0..a {
                prop_assert!(distinct.row(a) != distinct.row(b));
            }
        }
    }

    #[test]
    fn factor_of_a_root_has_its_task_matrix(
        values in prop::collection::vec(-2.0..2.0_f64, 15),
        rank in 1_usize..4,
    ) {
        let root = Mat::from_fn(5, rank, |row, col| values[3 * row + col]);
        let factor = TaskFactor::from_root(root.as_ref()).unwrap();
        prop_assert_eq!(factor.rank(), rank);
        let expected = &root * root.transpose();
        let difference = (TaskCovariance::Factor(factor).k_task() - &expected).norm_max();
        // Householder reflections: a few r ε of the squared size.
        prop_assert!(difference <= 50.0 * f64::EPSILON * 12.0, "{difference:e}");
    }
}

#[test]
fn task_matrix_and_correlations_worked_by_hand() {
    // Λ = [2 0; −3 4; 0 0]: K^ρ = [4 −6 0; −6 25 0; 0 0 0].
    let factor = TaskFactor::from_entries(3, 2, &[2.0, -3.0, 4.0, 0.0, 0.0]).unwrap();
    assert_eq!(factor.lambda(), mat![[2.0, 0.0], [-3.0, 4.0], [0.0, 0.0]]);
    assert_eq!(factor.entries(), [2.0, -3.0, 4.0, 0.0, 0.0]);
    let task = TaskCovariance::Factor(factor);
    assert_eq!(
        task.k_task(),
        mat![[4.0, -6.0, 0.0], [-6.0, 25.0, 0.0], [0.0, 0.0, 0.0]]
    );
    assert_eq!(
        task.correlations(),
        mat![[1.0, -0.6, 0.0], [-0.6, 1.0, 0.0], [0.0, 0.0, 1.0]]
    );
    assert_eq!((task.rank(), task.n_params(), task.n_tasks()), (2, 5, 3));
    assert_eq!(
        TaskCovariance::Ones { n_tasks: 2 }.k_task(),
        Mat::full(2, 2, 1.0)
    );
    assert_eq!(
        TaskCovariance::Identity { n_tasks: 2 }.k_task(),
        Mat::identity(2, 2)
    );
    // r(2m + 1 − r)/2 at m = 14: the counts of eq. (19).
    assert_eq!(
        [2, 4, 5].map(|rank| TaskFactor::count(14, rank)),
        [27, 50, 60]
    );
}
