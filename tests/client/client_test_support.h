// Shared by the tests of this folder: temporary folders, states made by hand, running programs.
#pragma once

#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "drape/error.h"
#include "drape/states.h"

namespace drape::client_test {

// A new folder, removed with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string ReadText(const std::filesystem::path& path);
std::vector<std::string> Lines(const std::string& text);
void WriteText(const std::filesystem::path& path, const std::string& text);

// The outcome of a program.
struct Outcome {
  int exit_code = -1;  // -1: ended by a signal
  std::string out;
  std::string err;
};

// A program of this build ("drape", "hello_client", ...) while it runs.
class RunningProgram {
 public:
  // `terminal`: path of a terminal for its stderr; empty = a file that Wait() reads.
  RunningProgram(const std::string& name, const std::vector<std::string>& arguments,
                 const std::string& terminal = "");
  // Waits for its end; once.
  Outcome Wait();
  int pid() const { return pid_; }

 private:
  TemporaryFolder folder_;
  bool has_terminal_;
  int pid_ = 0;
};

// Runs it to its end.
Outcome RunProgram(const std::string& name, const std::vector<std::string>& arguments);
std::filesystem::path ProgramPath(const std::string& name);

// client/examples/<name>
std::filesystem::path Example(const std::string& name);

// A scene named "springs", for 20 steps of 1 ms: cloth 0 rests, cloth 1 is faulted within ten
// steps. Its two particles are 1 cm off the rest length of a spring so stiff that their motion
// grows a hundredfold per step.
std::string SceneWithAFault();

// One array in a chunk, [elements.size() / 3, 3].
template <class Element>
v1::PackedArray Packed(const std::vector<Element>& elements) {
  v1::PackedArray array;
  array.set_data_type(sizeof(Element) == 8 ? v1::PackedArray::FLOAT64 : v1::PackedArray::FLOAT32);
  array.add_shape(static_cast<uint32_t>(elements.size() / 3));
  array.add_shape(3);
  array.set_data(elements.data(), elements.size() * sizeof(Element));
  return array;
}

// States of cloths with the given particle counts after `step` steps of 0.1 s; `positions` and
// `velocities` hold all of them.
template <class Element>
v1::StateChunk MakeChunk(std::initializer_list<uint32_t> particle_counts, uint64_t step,
                         const std::vector<Element>& positions,
                         const std::vector<Element>& velocities) {
  v1::StateChunk chunk;
  for (const uint32_t count : particle_counts) {
    chunk.add_cloth_ids(100 + static_cast<uint64_t>(chunk.cloth_ids_size()));
    chunk.add_particle_counts(count);
    chunk.add_steps(step);
    chunk.add_times_s(0.1 * static_cast<double>(step));
  }
  *chunk.mutable_positions_m() = Packed(positions);
  if (!velocities.empty()) *chunk.mutable_velocities_m_per_s() = Packed(velocities);
  chunk.set_is_last(true);
  return chunk;
}

template <class Element>
States MakeStates(std::initializer_list<uint32_t> particle_counts, uint64_t step,
                  const std::vector<Element>& positions, const std::vector<Element>& velocities) {
  return States({MakeChunk(particle_counts, step, positions, velocities)});
}

// Calls `function`; returns the drape::Error that it throws. A call that throws none fails the
// test.
template <class Function>
ErrorDetails ErrorOf(Function&& function);

[[noreturn]] void FailNoError();

template <class Function>
ErrorDetails ErrorOf(Function&& function) {
  try {
    function();
  } catch (const Error& error) {
    return error.details();
  }
  FailNoError();
}

}  // namespace drape::client_test
