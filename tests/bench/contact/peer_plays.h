// The scenes of `contact` for other programs, as text, and what they made of them.
#pragma once

#include <string>

#include "tests/bench/bench.h"
#include "tests/bench/contact/contact_scenes.h"

namespace drape::bench {

// FOLDER/NAME.play, numbers between spaces and ends of lines:
//   particles, triangles, columns (0: no grid), frames
//   of each particle the rest position [m] and the one at the start [m], and 0 for a pin, else 1
//   of each triangle three particles
//   of each frame the number of planes and of each a, b, c, d of ax + by + cz + d = 0; of spheres,
//   and of each the centre and the radius [m]; of targets, and of each the pin and its place [m]
// Aborts where a file cannot be written, or a collider is another one.
void WritePlay(const ContactPlay& play, const std::string& folder);

// -> contact_peers.csv: of each FOLDER/NAME.LABEL.positions, float32 [frames][particles][3] of the
// scene NAME, the frames with crossings, and the largest strain. Aborts where a file has another
// size.
void MeasurePeers(Bench& bench, const std::string& folder, const ContactPlayOptions& options);

}  // namespace drape::bench
