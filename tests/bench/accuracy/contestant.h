// A contestant plays a scene frame by frame: a cloth of a backend, or another program.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/scene/particle_state.h"
#include "tests/bench/accuracy/accuracy_scenes.h"
#include "tests/bench/timing.h"

namespace drape::bench {

struct FrameReport {
  uint32_t iterations = 0;  // sweeps
  bool is_faulted = false;  // has stopped: the state stays as it is
};

class Contestant {
 public:
  virtual ~Contestant() = default;

  // Back to the scene's start; also called before the first frame.
  virtual void Restart() = 0;
  // One frame of kFrame_s; the caller takes the time.
  virtual FrameReport Step() = 0;
  virtual ParticleState State() = 0;
};

// A cloth alone on the backend, which must outlive it, as must the scene.
std::unique_ptr<Contestant> MakeContestant(Backend& backend, const test::Scene& scene,
                                           const StepSettings& settings);

// A contestant and how the tables name it.
struct Entry {
  std::string program;  // a backend's name, or "bullet"
  Method method;
  std::string settings_text;
  std::unique_ptr<Contestant> contestant;
};

}  // namespace drape::bench
