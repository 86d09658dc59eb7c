//! The procedural terrain on the command line, and the picture of a working set.

use super::{folder, json, refused};

#[test]
fn the_endless_terrain_is_described_and_exported() {
    let folder = folder();
    let info = json(folder.path(), &["info", "endless"]);
    assert_eq!((&info["format"], &info["width"]), (&"endless".into(), &((1u64 << 29) + 1).into()));
    assert_ne!(json(folder.path(), &["info", "endless:7"])["max_m"], info["max_m"], "another seed");
    let near = ["export", "endless", "--technique", "sphere-tree", "--eye", "200000,+3,200000", "--pitch", "-20"];
    let export = json(folder.path(), &[&near[..], &["-o", "near.ply"]].concat());
    assert!(export["triangles"].as_u64() > Some(1000), "{export}");
}

#[test]
fn what_needs_samples_refuses_it_by_name() {
    let folder = folder();
    let eye = ["--eye", "200000,+3,200000"];
    let export = ["export", "endless", "-o", "a.ply", "--technique", "clusters"];
    refused(folder.path(), &[&export[..], &eye].concat(), &["clusters", "samples", "sphere-tree"]);
    refused(folder.path(), &["info", "endless", "--spacing", "2"], &["endless", "samples"]);
    let by_error = ["info", "endless", "--plan", "--technique", "sphere-tree", "--colour", "error"];
    refused(folder.path(), &by_error, &["--colour error", "endless", "samples"]);
    refused(folder.path(), &["info", "endless:stone"], &["endless:stone", "seed"]);
    refused(folder.path(), &["bench", "endless", "--out", "run"], &["bench", "every sample"]);
}

#[test]
fn a_working_set_is_drawn() {
    let folder = folder();
    let view = ["--technique", "sphere-tree", "--size", "320x200", "--eye", "9000,+200,9000", "--pitch", "-15"];
    let needed = json(folder.path(), &[&["info", "demo", "--working-set", "set.png"][..], &view].concat());
    let picture = image::open(folder.path().join("set.png")).expect("a picture").into_rgb8();
    let colours: std::collections::HashSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
    assert!(colours.len() > 4, "a node's level has a colour: {}", colours.len());
    // A node's texture has 64 × 64 texels, as on the device, of which a wedge may need few.
    assert!(needed["nodes"].as_u64() > Some(50) && needed["texels_a_pixel"].as_f64() < Some(7.0), "{needed}");
    assert_eq!(needed["texel_px"], 1.0, "{needed}");
    // As on the device, texels are longer where the memory does not hold them.
    let few = [&["info", "demo", "--working-set", "set.png", "--texture-memory", "2"][..], &view].concat();
    let few: Vec<_> = few.into_iter().map(|word| if word == "320x200" { "1600x1000" } else { word }).collect();
    let few = json(folder.path(), &few);
    assert!(few["nodes"].as_u64() <= few["slots"].as_u64(), "{few}");
    assert!(few["texel_px"].as_f64() > Some(1.0) && few["bytes"].as_u64() < Some(2_000_000), "{few}");
    refused(folder.path(), &["info", "demo", "--working-set", "set.txt"], &["set.txt", ".png"]);
}
