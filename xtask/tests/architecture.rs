//! The rules of ARCHITECTURE.md, read off the manifests and the sources.
//!
//! `cargo test -p xtask architecture`

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail"
)]

mod architecture {
    use std::collections::BTreeMap;
    use std::path::{Path, PathBuf};

    /// Side by side: none knows another.
    const STAGE_CRATES: [&str; 8] =
        ["ingest", "ground", "treetops", "segmentation", "crowns", "export", "report", "evaluate"];

    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
    }

    /// Folder names of the crates below `crates`, and `xtask`.
    fn crates() -> Vec<String> {
        let entries = std::fs::read_dir(root().join("crates")).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.push("xtask".to_owned());
        names.sort();
        names
    }

    fn folder(name: &str) -> PathBuf {
        if name == "xtask" { root().join("xtask") } else { root().join("crates").join(name) }
    }

    /// Names in a section of a crate's manifest.
    fn names_in(name: &str, section: &str) -> Vec<String> {
        let text = std::fs::read_to_string(folder(name).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = text.parse().unwrap();
        let table = manifest.get(section).and_then(toml::Value::as_table);
        table.map(|table| table.keys().cloned().collect()).unwrap_or_default()
    }

    /// Own crates a crate is built on, by folder name.
    fn own(name: &str, section: &str) -> Vec<String> {
        let all = names_in(name, section);
        all.iter().filter_map(|name| name.strip_prefix("timberline-")).map(str::to_owned).collect()
    }

    /// A source file with comments and test modules taken out.
    struct Source {
        /// Relative to the crate.
        path: String,
        code: String,
    }

    fn sources(name: &str) -> Vec<Source> {
        let mut found = Vec::new();
        let base = folder(name);
        xtask::engine::workdir::walk(&base.join("src"), &mut |path| {
            if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(path).unwrap();
                let path = path.strip_prefix(&base).unwrap().to_str().unwrap().replace('\\', "/");
                found.push(Source { path, code: product(&text) });
            }
        });
        found
    }

    /// What is part of the product: no comments, nothing from the first test module on.
    fn product(text: &str) -> String {
        let lines = text.lines().take_while(|line| !line.trim_start().starts_with("#[cfg(test)]"));
        let code = lines.filter(|line| !line.trim_start().starts_with("//"));
        code.fold(String::new(), |all, line| all + line.split(" // ").next().unwrap_or(line) + "\n")
    }

    /// Whether `word` stands in `code` as a word of its own.
    fn names(code: &str, word: &str) -> bool {
        let part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        code.match_indices(word).any(|(at, _)| {
            !part(code[..at].chars().next_back()) && !part(code[at + word.len()..].chars().next())
        })
    }

    fn report(faults: &[String]) {
        assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    }

    #[test]
    fn rule_1_stage_crates_know_only_pointcloud_and_artefact() {
        let mut faults = Vec::new();
        for name in STAGE_CRATES.iter().filter(|name| folder(name).exists()) {
            for other in own(name, "dependencies") {
                if !["pointcloud", "artefact"].contains(&other.as_str()) {
                    faults.push(format!("{name} depends on {other}"));
                }
            }
            for other in own(name, "dev-dependencies") {
                if STAGE_CRATES.contains(&other.as_str()) {
                    faults.push(format!("the tests of {name} depend on {other}"));
                }
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_1_every_crate_has_its_place() {
        let known = ["pointcloud", "artefact", "synth", "xtask"];
        let place =
            |name: &String| known.contains(&name.as_str()) || STAGE_CRATES.contains(&name.as_str());
        let lost: Vec<String> = crates().into_iter().filter(|name| !place(name)).collect();
        assert!(lost.is_empty(), "{lost:?}: add them to this test");
        assert_eq!(own("synth", "dependencies"), ["pointcloud"]);
    }

    #[test]
    fn rule_2_pointcloud_touches_no_file_and_knows_no_forest() {
        assert_eq!(own("pointcloud", "dependencies"), Vec::<String>::new());
        let forbidden = [
            "fs", "File", "PathBuf", "Path", "io", "tempfile", "forest", "tree_id", "crown",
            "treetop",
        ];
        let mut faults = Vec::new();
        for source in sources("pointcloud") {
            for word in forbidden.iter().filter(|word| names(&source.code, word)) {
                faults.push(format!("pointcloud/{} names `{word}`", source.path));
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_2_artefact_knows_no_algorithm() {
        assert_eq!(own("artefact", "dependencies"), ["pointcloud"]);
        let solvers =
            ["faer", "clarabel", "spade", "kiddo", "nalgebra", "rayon", "rand", "las", "laz"];
        let used = names_in("artefact", "dependencies");
        let faults: Vec<String> = solvers
            .iter()
            .filter(|name| used.iter().any(|used| used == *name))
            .map(|name| format!("artefact depends on {name}"))
            .collect();
        report(&faults);
    }

    /// Plain values of `artefact` that algorithms may speak of: they are no files.
    const VALUES: [&str; 8] =
        ["Crs", "Raster", "kinds", "Error", "stage::Params", "tree_id", "codec", "publish"];

    #[test]
    fn rule_3_only_stage_rs_reads_and_writes_artefacts() {
        // The layout inside shards belongs to the stage that writes them (kinds/shards.rs).
        let exempt = ["ingest/src/shard.rs"];
        let mut faults = Vec::new();
        for name in STAGE_CRATES.iter().filter(|name| folder(name).exists()) {
            for source in sources(name) {
                let place = format!("{name}/{}", source.path);
                if source.path.starts_with("src/stage") || exempt.contains(&place.as_str()) {
                    continue;
                }
                for used in uses_of_artefact(&source.code) {
                    if !VALUES.iter().any(|value| used.starts_with(value)) {
                        faults.push(format!("{place} names `timberline_artefact::{used}`"));
                    }
                }
            }
        }
        report(&faults);
    }

    /// What follows `timberline_artefact::`, groups in braces taken apart.
    fn uses_of_artefact(code: &str) -> Vec<String> {
        let mut used = Vec::new();
        for (at, start) in code.match_indices("timberline_artefact::") {
            let rest = &code[at + start.len()..];
            match rest.strip_prefix('{') {
                Some(group) => {
                    let group = group.split('}').next().unwrap_or(group);
                    used.extend(
                        group
                            .split(',')
                            .map(|part| part.trim().to_owned())
                            .filter(|part| !part.is_empty()),
                    );
                }
                None => {
                    let end = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
                    used.push(rest.split(end).next().unwrap_or(rest).to_owned());
                }
            }
        }
        used
    }

    #[test]
    fn rule_4_libraries_stay_where_they_belong() {
        let homes: [(&[&str], &[&str]); 9] = [
            (
                &["clap", "clap_complete", "indicatif", "toml", "toml_edit", "anyhow", "ctrlc"],
                &["xtask"],
            ),
            (&["las", "laz"], &["ingest", "export"]),
            (&["e57", "ply-rs-bw"], &["ingest"]),
            (
                &["rusqlite", "postgres", "tiff", "parquet", "flatgeobuf", "geotiff-writer"],
                &["export"],
            ),
            (&["image", "plotters", "plotly", "ab_glyph"], &["report"]),
            (&["bincode", "mcap", "foxglove"], &["artefact"]),
            (&["faer", "spade"], &["ground"]),
            (&["clarabel"], &["crowns"]),
            (&["kiddo"], &["pointcloud"]),
        ];
        let mut faults = Vec::new();
        for name in crates() {
            for used in names_in(&name, "dependencies") {
                for (libraries, allowed) in homes {
                    if libraries.contains(&used.as_str()) && !allowed.contains(&name.as_str()) {
                        faults.push(format!(
                            "{name} depends on {used}, which belongs in {}",
                            allowed.join(", ")
                        ));
                    }
                }
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_4_one_file_names_bincode() {
        let all = sources("artefact");
        let files: Vec<&str> = all
            .iter()
            .filter(|source| names(&source.code, "bincode"))
            .map(|source| source.path.as_str())
            .collect();
        assert_eq!(files, ["src/codec.rs"]);
    }

    #[test]
    fn rule_5_nothing_depends_on_time_threads_or_hashes() {
        let forbidden = [
            "HashMap",
            "HashSet",
            "RandomState",
            "SystemTime",
            "Instant",
            "thread_rng",
            "from_os_rng",
            "current_num_threads",
            "current_thread_index",
            "available_parallelism",
            "env::var",
            "par_bridge",
            "find_any",
            "find_map_any",
            "position_any",
            "try_for_each_any",
        ];
        let mut faults = Vec::new();
        for name in crates().into_iter().filter(|name| name != "xtask") {
            for source in sources(&name) {
                for word in forbidden.iter().filter(|word| names(&source.code, word)) {
                    faults.push(format!("{name}/{} names `{word}`", source.path));
                }
            }
        }
        report(&faults);
    }

    /// Number of lines of every function, by `crate/file: name`.
    fn function_lengths() -> BTreeMap<String, usize> {
        let mut lengths = BTreeMap::new();
        for name in crates() {
            for source in sources(&name) {
                let lines: Vec<&str> = source.code.lines().collect();
                for (index, line) in lines.iter().enumerate() {
                    let indent = line.len() - line.trim_start().len();
                    let begins = line.contains("fn ") && !line.trim_end().ends_with(';');
                    if !begins || line.trim_end().ends_with('}') {
                        continue;
                    }
                    let closes = format!("{}}}", " ".repeat(indent));
                    let end = lines[index..].iter().position(|later| later.starts_with(&closes));
                    if let Some(end) = end {
                        let title = line.trim().split('(').next().unwrap_or(line);
                        lengths.insert(
                            format!("{name}/{}:{} {title}", source.path, index + 1),
                            end + 1,
                        );
                    }
                }
            }
        }
        lengths
    }

    #[test]
    fn nine_of_ten_functions_are_short() {
        const SHORT: usize = 35;
        const LONG: usize = 90;
        let lengths = function_lengths();
        let short = lengths.values().filter(|lines| **lines <= SHORT).count();
        let mut long: Vec<_> = lengths.iter().filter(|(_, lines)| **lines > LONG).collect();
        long.sort();
        let share = short as f64 / lengths.len() as f64;
        println!("{} functions, {:.1} % of at most {SHORT} lines", lengths.len(), share * 100.0);
        assert!(
            share >= 0.9,
            "only {:.1} % of the functions have at most {SHORT} lines",
            share * 100.0
        );
        assert!(long.is_empty(), "functions of more than {LONG} lines: {long:#?}");
    }

    #[test]
    fn files_have_one_subject() {
        const MOST: usize = 600;
        let mut faults = Vec::new();
        for name in crates() {
            for source in sources(&name) {
                let lines = source.code.lines().count();
                if lines > MOST {
                    faults.push(format!("{name}/{}: {lines} lines", source.path));
                }
            }
        }
        report(&faults);
    }
}
