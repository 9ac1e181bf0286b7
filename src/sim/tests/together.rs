//! Worlds that step together move as if each were alone.

use super::*;

/// Eleven characters, of which no two do the same: they fall from different heights, some are pushed or are heavier.
fn crowd(character: &Character, settings: Settings) -> Vec<World> {
    let new = |i: usize| {
        let mut world = World::new(character, settings);
        let mut states = standing(character, 0.7 + 0.05 * i as f32);
        states[0].linear.x = i as f32 * 0.3 - 1.0;
        world.reset(&states);
        if i.is_multiple_of(3) {
            world.vary(1.0 + 0.02 * i as f32, 0.8);
            world.push(1, Vector3::new(3.0, i as f32, 0.0));
        }
        world
    };
    (0..11).map(new).collect()
}

#[test]
fn each_of_several_worlds_moves_as_if_alone_to_the_bit() {
    let (character, settings) = (humanoid(), Settings::default());
    let (mut alone, mut together) = (crowd(&character, settings), crowd(&character, settings));
    let mut results = vec![Ok(()); together.len()];
    let mut touched = 0;
    for step in 0..45 {
        for worlds in [&mut alone, &mut together] {
            for (i, world) in worlds.iter_mut().enumerate() {
                world.set_targets(&swinging(&character, step + 7 * i));
            }
        }
        let mut all: Vec<&mut World> = together.iter_mut().collect();
        World::step_together(&mut all, &mut results);
        for (i, (one, other)) in alone.iter_mut().zip(&together).enumerate() {
            assert_eq!(one.step(), results[i]);
            assert_eq!(one.states(), other.states(), "world {i}, step {step}");
            assert_eq!(one.contacts(), other.contacts(), "world {i}, step {step}");
            touched += one.contacts().iter().filter(|&&c| c).count();
        }
    }
    assert!(touched > 200, "they hardly touched the ground: {touched}");
}

#[test]
fn one_that_diverges_leaves_the_others_alone() {
    let (character, settings) = (humanoid(), Settings::default());
    let (mut alone, mut together) = (crowd(&character, settings), crowd(&character, settings));
    let mut broken = standing(&character, 1.0);
    broken[0].linear.x = f32::NAN;
    together[3].reset(&broken);
    let mut results = vec![Ok(()); together.len()];
    for step in 0..20 {
        let mut all: Vec<&mut World> = together.iter_mut().collect();
        World::step_together(&mut all, &mut results);
        for (i, (one, other)) in alone.iter_mut().zip(&together).enumerate() {
            let stepped = one.step();
            let expected = if i == 3 { Err(Diverged) } else { stepped };
            assert_eq!(results[i], expected, "world {i}, step {step}");
            if i != 3 {
                assert_eq!(one.states(), other.states(), "world {i}, step {step}");
            }
        }
    }
}
