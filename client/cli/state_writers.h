// Files of particle states. CSV, NPZ, PC2 and USDA hold every sample; OBJ and PLY the last state,
// or one file per sample.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/topology.h"
#include "drape/states.h"

namespace drape::cli {

// The time of a sample of a run.
struct SampleTime {
  uint64_t step = 0;
  double time_s = 0;
};

// Takes the samples of a run in order. Opens its file when constructed, so that a path that cannot
// be written fails before the run; throws drape::Error (reason "CANNOT_WRITE").
class StateWriter {
 public:
  virtual ~StateWriter() = default;
  // True: Add is called for every sample. False: once, for the last state.
  virtual bool takes_samples() const = 0;
  // The states of all cloths in scene order after one step: positions, and velocities (which OBJ
  // and PC2 leave out). Written with the time of the sample, which a faulted cloth does not reach,
  // or without one with the time of each cloth.
  void Add(const States& states, const std::optional<SampleTime>& sample = std::nullopt) {
    DoAdd(states, sample);
  }
  // Completes and closes the file, which appears only now. Call it once.
  virtual void Finish() = 0;

 private:
  virtual void DoAdd(const States& states, const std::optional<SampleTime>& sample) = 0;
};

// The facts that writers need besides the states.
struct StateFileOptions {
  uint32_t ParticleOf(size_t row) const {
    return particles.empty() ? static_cast<uint32_t>(row) : particles[row];
  }

  std::vector<Topology> topologies;  // one per cloth in scene order, or empty (points)
  double time_step_s = 0;            // of the scene; 0 = unknown
  bool is_series = false;            // OBJ and PLY: one file per sample, named by SeriesPath
  // The particle of each row of the states, for every cloth; empty: the row's index.
  std::vector<uint32_t> particles{};
};

// By extension: .csv, .npz, .obj, .pc2, .ply or .usda.
std::unique_ptr<StateWriter> MakeStateWriter(const std::filesystem::path& path,
                                             StateFileOptions options);

// MakeStateWriter knows the extension.
bool IsStateFile(const std::filesystem::path& path);
// The extensions that MakeStateWriter knows: ".csv, ... or .usda".
std::string StateFileExtensions();

// Columns time_s,cloth,particle,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s; `cloth` counts from 0
// in scene order. 9 significant digits for float32 and 17 for float64: equal text is equal bits
// (except for the time, a double with the digits of its row).
std::unique_ptr<StateWriter> MakeCsvWriter(const std::filesystem::path& path,
                                           StateFileOptions options);
// Arrays times [T], steps [T], positions [T, P, 3], velocities [T, P, 3], cloth [P], particle [P]
// (P = particles of all cloths), uncompressed, in the precision of the backend.
std::unique_ptr<StateWriter> MakeNpzWriter(const std::filesystem::path& path,
                                           StateFileOptions options);
// One object per cloth. Numbers have the digits of CSV.
std::unique_ptr<StateWriter> MakeObjWriter(const std::filesystem::path& path,
                                           StateFileOptions options);
// ASCII; elements vertex (x, y, z, cloth and, where states have velocities, vx, vy, vz), face,
// edge. Numbers have the digits of CSV.
std::unique_ptr<StateWriter> MakePlyWriter(const std::filesystem::path& path,
                                           StateFileOptions options);
// The point cache of 3ds Max and Blender, version 1: positions of all particles in scene order,
// rounded to float32. One sample after the other; start and sampling are in steps.
std::unique_ptr<StateWriter> MakePc2Writer(const std::filesystem::path& path);
// USD as text, rounded to float32: a Mesh per cloth (curves and points where there are no
// triangles) with points and velocities as time samples. A time code is a step; without a time step
// it is a second.
std::unique_ptr<StateWriter> MakeUsdaWriter(const std::filesystem::path& path,
                                            StateFileOptions options);

}  // namespace drape::cli
