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
    const STAGE_CRATES: [&str; 12] = [
        "ingest",
        "ground",
        "treetops",
        "segmentation",
        "crowns",
        "stems",
        "wlop",
        "skeleton",
        "qsm",
        "export",
        "report",
        "evaluate",
    ];

    /// What stage crates may know.
    const BELOW: [&str; 4] = ["pointcloud", "boosting", "solids", "artefact"];

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

    /// Packages in a section of a crate's manifest, also those for one platform only. What a build
    /// script needs counts as a dependency.
    fn names_in(name: &str, section: &str) -> Vec<String> {
        let text = std::fs::read_to_string(folder(name).join("Cargo.toml")).unwrap();
        packages(&text.parse().unwrap(), section)
    }

    fn packages(manifest: &toml::Table, section: &str) -> Vec<String> {
        let platforms = manifest.get("target").and_then(toml::Value::as_table);
        let parts = platforms.into_iter().flat_map(toml::Table::values);
        let parts = parts.filter_map(toml::Value::as_table).chain([manifest]);
        let sections = ["build-dependencies", section];
        let from = if section == "dependencies" { 0 } else { 1 };
        let tables =
            parts.flat_map(|part| sections[from..].iter().filter_map(|key| part.get(*key)));
        let rows = tables.filter_map(toml::Value::as_table).flatten();
        let real = |(name, value): (&String, &toml::Value)| {
            value.get("package").and_then(toml::Value::as_str).unwrap_or(name).to_owned()
        };
        rows.map(real).collect()
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

    /// What is part of the product: no comments, no items for tests only.
    fn product(text: &str) -> String {
        let (mut code, mut lines) = (String::new(), text.lines());
        while let Some(line) = lines.next() {
            if line.trim_start().starts_with("#[cfg(test)]") {
                // The item ends where its indent comes back.
                lines.find(|last| indent(last) == indent(line) && last.ends_with([';', '}']));
            } else if !line.trim_start().starts_with("//") {
                code += line.split(" // ").next().unwrap_or(line);
                code += "\n";
            }
        }
        code
    }

    fn indent(line: &str) -> usize {
        line.len() - line.trim_start().len()
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
    fn rule_1_stage_crates_know_only_what_lies_below() {
        let mut faults = Vec::new();
        for name in STAGE_CRATES.iter().filter(|name| folder(name).exists()) {
            for other in own(name, "dependencies") {
                if !BELOW.contains(&other.as_str()) {
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
        let known = [&BELOW[..], &["synth", "experiment", "xtask"]].concat();
        let place =
            |name: &String| known.contains(&name.as_str()) || STAGE_CRATES.contains(&name.as_str());
        let lost: Vec<String> = crates().into_iter().filter(|name| !place(name)).collect();
        assert!(lost.is_empty(), "{lost:?}: add them to this test");
        assert_eq!(own("synth", "dependencies"), ["pointcloud"]);
    }

    #[test]
    fn rule_1_only_the_orchestrator_knows_experiments() {
        let mut faults = Vec::new();
        for name in crates().into_iter().filter(|name| name != "xtask") {
            for section in ["dependencies", "dev-dependencies"] {
                if own(&name, section).iter().any(|other| other == "experiment") {
                    faults.push(format!("{name} depends on experiment ({section})"));
                }
            }
        }
        // Experiments compute; pictures and files are made by others.
        for other in own("experiment", "dependencies") {
            if ["ingest", "export", "report"].contains(&other.as_str()) {
                faults.push(format!("experiment depends on {other}"));
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_2_the_lowest_crates_touch_no_file_and_know_no_forest() {
        let files = ["fs", "File", "PathBuf", "Path", "io", "tempfile"];
        let forest = ["forest", "crown", "treetop", "tree_id", "treeid", "canopy"];
        let mut faults = Vec::new();
        for name in ["pointcloud", "boosting", "solids"] {
            assert_eq!(own(name, "dependencies"), Vec::<String>::new(), "{name}");
            for source in sources(name) {
                let lower = source.code.to_lowercase();
                let file = files.iter().filter(|word| names(&source.code, word));
                let words = file.chain(forest.iter().filter(|word| lower.contains(**word)));
                faults.extend(words.map(|word| format!("{name}/{} names `{word}`", source.path)));
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_2_artefact_knows_no_algorithm() {
        assert_eq!(own("artefact", "dependencies"), ["pointcloud"]);
        let solvers = [
            "faer", "clarabel", "spade", "kiddo", "nalgebra", "libm", "rayon", "rand", "las", "laz",
        ];
        let used = names_in("artefact", "dependencies");
        let faults: Vec<String> = solvers
            .iter()
            .filter(|name| used.iter().any(|used| used == *name))
            .map(|name| format!("artefact depends on {name}"))
            .collect();
        report(&faults);
    }

    /// Plain values of `artefact` that algorithms may speak of: they are no files.
    const VALUES: [&str; 6] = ["Crs", "Raster", "kinds", "Error", "stage::Params", "tree_id"];

    /// The door to programs of the user's: it has files, processes, a clock and a format.
    const HOOK: &str = "segmentation/src/hook/";

    /// Sources of the stage crates that are no part of a `stage` module.
    fn algorithms(names: &[&str]) -> Vec<Source> {
        let mut found = Vec::new();
        for name in names.iter().filter(|name| folder(name).exists()) {
            for Source { path, code } in sources(name) {
                if !path.starts_with("src/stage") {
                    found.push(Source { path: format!("{name}/{path}"), code });
                }
            }
        }
        found
    }

    #[test]
    fn rule_3_only_stage_rs_reads_and_writes_artefacts() {
        // The layout inside shards belongs to the stage that writes them (kinds/shards.rs).
        let exempt = ["ingest/src/shard.rs"];
        let within = |used: &str, module: &str| {
            used.strip_prefix(module).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        };
        let mut faults = Vec::new();
        for source in algorithms(&STAGE_CRATES) {
            if exempt.contains(&source.path.as_str()) {
                continue;
            }
            // What `export` writes is no artefact, but it appears whole or not at all as they do, and
            // trees that are sorted on disk wait there in the same encoding.
            let door =
                if source.path.starts_with("export/") { &["publish", "codec"][..] } else { &[] };
            for used in uses_of_artefact(&source.code) {
                if !VALUES.iter().chain(door).any(|value| within(&used, value)) {
                    faults.push(format!("{} names `{used}` of artefact", source.path));
                }
            }
        }
        report(&faults);
    }

    #[test]
    fn rule_3_algorithms_touch_no_file() {
        // The other stage crates are about files: `ingest` reads them, `export` and `report` write.
        let pure = ["ground", "treetops", "segmentation", "crowns", "skeleton", "qsm", "evaluate"];
        let mut faults = Vec::new();
        for source in algorithms(&pure).iter().filter(|source| !source.path.starts_with(HOOK)) {
            for word in ["fs", "File", "OpenOptions", "PathBuf", "tempfile"] {
                if names(&source.code, word) {
                    faults.push(format!("{} names `{word}`", source.path));
                }
            }
        }
        report(&faults);
    }

    /// Paths inside `timberline_artefact` that occur, groups in braces taken apart.
    fn uses_of_artefact(code: &str) -> Vec<String> {
        let mut used = Vec::new();
        for (at, name) in code.match_indices("timberline_artefact") {
            match code[at + name.len()..].strip_prefix("::") {
                Some(tree) => expand("", tree, &mut used),
                None => used.push("all, under another name".to_owned()),
            }
        }
        used
    }

    /// Adds the paths of a tree of `use`, which may be followed by other code.
    fn expand(prefix: &str, tree: &str, used: &mut Vec<String>) {
        let part = |c: char| c.is_alphanumeric() || "_:*".contains(c);
        let end = tree.find(|c| !part(c)).unwrap_or(tree.len());
        let path = format!("{prefix}{}", &tree[..end]);
        match tree[end..].strip_prefix('{') {
            Some(group) if path.is_empty() || path.ends_with("::") => {
                members(group).into_iter().for_each(|member| expand(&path, member, used));
            }
            _ => used.push(path),
        }
    }

    /// The members of a group whose opening brace was just passed.
    fn members(group: &str) -> Vec<&str> {
        let (mut found, mut depth, mut start) = (Vec::new(), 0, 0);
        for (at, c) in group.char_indices() {
            if depth == 0 && matches!(c, ',' | '}') {
                found.push(group[start..at].trim());
                start = at + 1;
            }
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                _ => {}
            }
        }
        found.retain(|member| !member.is_empty());
        found
    }

    #[test]
    fn the_checks_see_through_forms() {
        let code = "use timberline_artefact::{kinds::{Trees, Heights}, read,\n stage::{Params, Stage}};\n\
            use timberline_artefact as a;\nlet crs = timberline_artefact::Crs { epsg };\n";
        let expected = [
            "kinds::Trees",
            "kinds::Heights",
            "read",
            "stage::Params",
            "stage::Stage",
            "all, under another name",
            "Crs",
        ];
        assert_eq!(uses_of_artefact(code), expected);
        let text = "#[cfg(test)]\nmod testing;\nuse a;\nfn b() {\n    // c\n    #[cfg(test)]\n    \
            d();\n    e(); // f\n}\n#[cfg(test)]\nmod tests {\n    fn g() {\n    }\n}\nuse h;\n";
        assert_eq!(product(text), "use a;\nfn b() {\n    e();\n}\nuse h;\n");
        let manifest = "[dependencies]\na = \"1\"\nb = { package = \"las\" }\n[build-dependencies]\nc = \"1\"\n\
            [dev-dependencies]\nd = \"1\"\n[target.'cfg(unix)'.dependencies]\ne.workspace = true\n";
        let mut all = packages(&manifest.parse().unwrap(), "dependencies");
        all.sort();
        assert_eq!(all, ["a", "c", "e", "las"]);
    }

    #[test]
    fn rule_4_libraries_stay_where_they_belong() {
        let terminal: &[&str] = &[
            "clap",
            "clap_complete",
            "indicatif",
            "toml",
            "toml_edit",
            "anyhow",
            "ctrlc",
            "tracing-subscriber",
        ];
        let homes: [(&[&str], &[&str]); 13] = [
            (terminal, &["xtask"]),
            (&["laz"], &["ingest"]),
            (&["las"], &["export", "segmentation"]),
            (&["rustix"], &["segmentation"]),
            (&["e57", "ply-rs-bw"], &["ingest"]),
            (
                &["rusqlite", "postgres", "tiff", "parquet", "flatgeobuf", "geotiff-writer"],
                &["export"],
            ),
            (&["image", "plotters", "plotters-backend", "plotly", "ab_glyph"], &["report"]),
            (&["bincode"], &["artefact"]),
            // Artefacts, and recordings of single trees for viewers.
            (&["mcap", "foxglove"], &["artefact", "export"]),
            (&["faer"], &["ground"]),
            // Surfaces through points: of the ground, and of the canopy.
            (&["spade"], &["ground", "segmentation"]),
            (&["clarabel"], &["crowns"]),
            (&["simple_delaunay_lib"], &["skeleton"]),
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
    fn rule_4_one_folder_of_segmentation_names_las_and_processes() {
        let mut faults = Vec::new();
        for Source { path, code } in sources("segmentation") {
            for word in ["las", "rustix", "process", "thread"] {
                if names(&code, word) && !format!("segmentation/{path}").starts_with(HOOK) {
                    faults.push(format!("segmentation/{path} names `{word}`"));
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
            "std::time",
            "SystemTime",
            "Instant",
            "thread_rng",
            "from_os_rng",
            "current_num_threads",
            "current_thread_index",
            "available_parallelism",
            "std::env",
            "env::var",
            "env::var_os",
            "par_bridge",
            "find_any",
            "find_map_any",
            "position_any",
            "try_for_each_any",
        ];
        let mut faults = Vec::new();
        for name in crates().into_iter().filter(|name| name != "xtask") {
            for source in sources(&name) {
                // A program that is run for a user has a time limit.
                let of_limits = ["std::time", "Instant"];
                let exempt = format!("{name}/{}", source.path).starts_with(HOOK);
                for word in forbidden.iter().filter(|word| names(&source.code, word)) {
                    if exempt && of_limits.contains(word) {
                        continue;
                    }
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
                    let begins = line.contains("fn ") && !line.trim_end().ends_with(';');
                    if !begins || line.trim_end().ends_with('}') {
                        continue;
                    }
                    let closes = format!("{}}}", " ".repeat(indent(line)));
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
        // Printed by `xtask experiment detection`.
        const TABLES: [&str; 2] = ["treetops/src/model.rs", "crowns/src/detection/model.rs"];
        let mut faults = Vec::new();
        for name in crates() {
            for source in sources(&name) {
                let lines = source.code.lines().count();
                let path = format!("{name}/{}", source.path);
                if lines > MOST && !TABLES.contains(&path.as_str()) {
                    faults.push(format!("{path}: {lines} lines"));
                }
            }
        }
        report(&faults);
    }
}
