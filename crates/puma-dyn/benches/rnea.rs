//! RNEA, CRBA and ABA of the PUMA 560, each checked before it is timed.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use puma_dyn::{Context, Effects, Model, Payload, Workspace, aba, crba, puma560, rnea};

/// One state away from every symmetry of the arm.
const Q: [f64; 6] = [0.3, -0.8, 1.1, 0.6, -0.9, 2.0];
const QD: [f64; 6] = [0.5, -0.4, 0.9, -1.3, 0.2, 0.7];
const QDD: [f64; 6] = [1.0, 2.0, -1.5, 0.8, -0.3, 0.1];

fn loaded(model: &Model) -> Context {
    let payload = Payload::cuboid(2.0, [0.1, 0.2, 0.3], [0.02, 0.0, 0.1], [0.3, -0.2, 0.5]);
    let flange = model
        .frame_idx(puma560::LAST_LINK)
        .expect("the PUMA has it");
    let attached = model.attach(flange, &payload.expect("a possible cuboid"));
    attached.expect("the flange moves").into()
}

/// ABA must undo RNEA, and RNEA must equal the inertia matrix times q̈ plus its value at rest.
fn check(model: &Model, workspace: &mut Workspace, context: &Context) -> [f64; 6] {
    let (mut tau, mut bias, mut qdd, mut matrix) = ([0.0; 6], [0.0; 6], [0.0; 6], [0.0; 36]);
    let all = Effects::ALL;
    rnea(model, workspace, all, context, &Q, &QD, &QDD, &mut tau);
    rnea(
        model, workspace, all, context, &Q, &QD, &[0.0; 6], &mut bias,
    );
    crba(model, workspace, all, context, &Q, &mut matrix);
    aba(model, workspace, all, context, &Q, &QD, &tau, &mut qdd).expect("M > 0");
    for joint in 0..6 {
        let row = &matrix[6 * joint..][..6];
        let sum = bias[joint] + row.iter().zip(QDD).map(|(m, qdd)| m * qdd).sum::<f64>();
        assert!(
            (sum - tau[joint]).abs() < 1e-12 * 100.0,
            "{sum} {}",
            tau[joint]
        );
        assert!((qdd[joint] - QDD[joint]).abs() < 1e-10, "{qdd:?}");
    }
    tau
}

fn puma(c: &mut Criterion) {
    let model = puma560::model();
    let (mut workspace, context) = (Workspace::new(&model), loaded(&model));
    let ws = &mut workspace;
    let torques = check(&model, ws, &context);
    let (mut tau, mut matrix) = ([0.0; 6], [0.0; 36]);

    let mut group = c.benchmark_group("puma560");
    for (name, effects, context) in [
        ("rnea/rigid", Effects::RIGID_BODY, &Context::empty()),
        ("rnea/friction+rotor+payload", Effects::ALL, &context),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| {
                let (q, qd, qdd) = (black_box(&Q), black_box(&QD), black_box(&QDD));
                rnea(&model, ws, effects, context, q, qd, qdd, &mut tau);
                tau[0]
            });
        });
    }
    group.bench_function("crba", |b| {
        b.iter(|| {
            crba(
                &model,
                ws,
                Effects::ALL,
                &context,
                black_box(&Q),
                &mut matrix,
            );
        });
    });
    group.bench_function("aba", |b| {
        b.iter(|| {
            let (q, qd) = (black_box(&Q), black_box(&QD));
            aba(
                &model,
                ws,
                Effects::ALL,
                &context,
                q,
                qd,
                &torques,
                &mut tau,
            )
        });
    });
    group.finish();
}

criterion_group!(benches, puma);
criterion_main!(benches);
