// Shared by OBJ and PLY: one state in one file, the last of a run or each of its samples.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"

namespace drape::cli {

// Writes the states as a whole file. `topologies`: one per cloth, or empty (points).
using WriteGeometry = void (*)(const States& states, const std::vector<Topology>& topologies,
                               OutputFile& file);

std::unique_ptr<StateWriter> MakeGeometryWriter(const std::filesystem::path& path,
                                                StateFileOptions options, WriteGeometry write);

// The topology of one cloth; without elements when there is none.
const Topology& TopologyAt(const std::vector<Topology>& topologies, size_t cloth);

// "x y z" of a row, in the digits of its type.
void AppendVector(const VectorView& vectors, size_t row, std::string* text);

// " a b c\n", each index shifted by `offset`.
void AppendIndices(std::span<const uint32_t> indices, uint64_t offset, std::string* text);

}  // namespace drape::cli
