// Files of particle states: S.csv, S.npz (every sample) and S.obj, S.ply (the last state).
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

// When a sample of a run was taken.
struct SampleTime {
  uint64_t step = 0;
  double time_s = 0;
};

// Takes the samples of a run in order. Opens its file when constructed, so that a path that cannot
// be written fails before the run; throws drape::Error (reason "CANNOT_WRITE").
class StateWriter {
 public:
  virtual ~StateWriter() = default;
  // True: Add is called for every sample, with positions and velocities. False: once, for the last
  // state; positions are enough.
  virtual bool takes_samples() const = 0;
  // The states of all cloths in scene order after one step. Written with the time of the sample,
  // which a faulted cloth does not reach, or without one with the time of each cloth.
  void Add(const States& states, const std::optional<SampleTime>& sample = std::nullopt) {
    DoAdd(states, sample);
  }
  // Completes and closes the file, which appears only now. Once.
  virtual void Finish() = 0;

 private:
  virtual void DoAdd(const States& states, const std::optional<SampleTime>& sample) = 0;
};

// By extension: .csv, .npz, .obj or .ply. `topologies`: one per cloth, or empty (points).
std::unique_ptr<StateWriter> MakeStateWriter(const std::filesystem::path& path,
                                             std::vector<Topology> topologies);

// The extensions that MakeStateWriter knows.
bool IsStateFile(const std::filesystem::path& path);

// Columns time_s,cloth,particle,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s; `cloth` counts from 0
// in scene order. 9 significant digits for float32 and 17 for float64: equal text is equal bits
// (but of the time, whose double has the digits of its row).
std::unique_ptr<StateWriter> MakeCsvWriter(const std::filesystem::path& path);
// Arrays times [T], steps [T], positions [T, P, 3], velocities [T, P, 3], cloth [P], particle [P]
// (P = particles of all cloths), uncompressed, in the precision of the backend.
std::unique_ptr<StateWriter> MakeNpzWriter(const std::filesystem::path& path);
// One object per cloth.
std::unique_ptr<StateWriter> MakeObjWriter(const std::filesystem::path& path,
                                           std::vector<Topology> topologies);
// ASCII; elements vertex (x, y, z, cloth), face, edge.
std::unique_ptr<StateWriter> MakePlyWriter(const std::filesystem::path& path,
                                           std::vector<Topology> topologies);

}  // namespace drape::cli
