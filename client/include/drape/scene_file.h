// Scene files, which `drape run` reads (message drape.v1.Scene as protobuf JSON, snake_case names).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "drape/error.h"
#include "drape/v1/scene.pb.h"

namespace drape {
inline namespace client {

// Reads and checks a scene: unknown fields, wrong kinds of values, nested vectors, sizes and ranges
// of values that the client itself uses, controls of particles that are not pinned. The server
// checks everything else. Mesh files are read (relative to the scene file) and replaced by meshes.
// In the result `time_step_s` is set, also in every cloth's settings. LoadScene fills in an empty
// `name` (the file's name without extension).
//
// `sets`: "path=value" each, applied to the spec of every cloth before anything is checked, e.g.
// "settings.substeps=8", "environment.gravity_m_per_s2=[0,-1,0]", "pins.0.particle=3". The value is
// JSON; any other text is taken as a string.
//
// Thread-safe. Throws kNotFound without the file, else kInvalidArgument naming the field.
v1::Scene LoadScene(const std::filesystem::path& path, std::span<const std::string> sets = {});

// The same from text. `folder` is where relative mesh files are looked for.
v1::Scene ParseScene(std::string_view json_text, const std::filesystem::path& folder,
                     std::span<const std::string> sets = {});

// llround(duration_s / time_step_s) of a loaded scene.
uint64_t StepCount(const v1::Scene& scene);

// Cloths of a loaded scene, copies counted.
uint64_t ClothCount(const v1::Scene& scene);

// The first step that begins at or after `time_s`, to within the rounding of k * time_step_s.
uint64_t FirstStepAtOrAfter(double time_s, double time_step_s);

}  // namespace client
}  // namespace drape
