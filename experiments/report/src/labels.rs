//! Plain words for what files and programs know by a short name; those for decoders are in the table of decoders.

/// What an object is called in figures and on the page.
pub(crate) fn object_label(name: &str) -> &str {
    match name {
        "center" => "lid with a hole",
        "circle" => "round plate",
        "gel" => "gel tube",
        "line" => "bar",
        "perfume" => "perfume bottle",
        "rec" => "rectangle",
        "smallT" => "small T",
        "tape" => "roll of tape",
        "tennis" => "tennis ball",
        "trig" => "triangle",
        other => other,
    }
}

/// What a statistic of a recording is called.
pub(crate) fn statistic_label(name: &str) -> String {
    match name {
        "residual" => "residual of the fit, V",
        "h1" => "memory of the last sample",
        "h2" => "memory of the sample before",
        "outliers_5sd" => "share of outliers beyond 5 standard deviations",
        "late_per_flip" => "late updates a change of sign",
        "idle_noise" => "noise without contact, V",
        "kurtosis" => "kurtosis of the residual",
        "quantile_gap" => "largest distance of two quantiles, V",
        "step_v" => "step of the converter, V",
        "idle_sd" => "drift without contact, V",
        "idle_parity" => "even and odd samples without contact, V",
        "unexplained_outliers" => "share of unexplained outliers",
        other => return other.replace('_', " "),
    }
    .to_owned()
}

/// Names of objects in a text, separated by spaces, in plain words.
pub(crate) fn object_list(names: &str) -> String {
    names.split_whitespace().map(object_label).collect::<Vec<_>>().join(", ")
}

/// What a score is called.
pub(crate) fn score_label(name: &str) -> String {
    match name {
        "support" => "support accuracy".to_owned(),
        "iou" => "IoU".to_owned(),
        "f1" => "F1".to_owned(),
        "class_single" => "single windows classified".to_owned(),
        "class_vote20" => "votes of 20 classified".to_owned(),
        other => other.replace('_', " "),
    }
}
