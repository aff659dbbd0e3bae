// Plays a scene in a session: creates its cloths and steps them, with its controls at their times.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "drape/error.h"
#include "drape/session.h"
#include "drape/v1/scene.pb.h"
#include "drape/v1/simulation_service.pb.h"
#include "drape/v1/step.pb.h"

namespace drape {
inline namespace client {

// One cloth of a scene being played; in scene order, copies counted.
struct PlayedCloth {
  ClothId id = 0;
  int entry = 0;  // index in scene.cloths
  v1::ClothShape shape;
};

// Results and wall time of some steps.
struct AdvanceResult {
  // One per cloth in scene order, measured after the last of the steps; empty unless requested.
  std::vector<v1::StepReport> reports;
  // Of the last of the steps; empty unless `has_impulses`.
  bool has_impulses = false;
  v1::ColliderImpulses collider_impulses;
  v1::PinImpulses pin_impulses;
  double wait_s = 0;       // spent waiting for the answers to Step requests
  uint64_t device_us = 0;  // the device's share of it, as the server measured it
};

// One thread at a time. The session must outlive it and hold no other cloths.
class ScenePlayer {
 public:
  // `scene` comes from LoadScene or ParseScene. Creates all cloths, or none: a refusal is an
  // Error whose message begins with the entry, or with its field that is wrong,
  // "cloths[3].spec.grid.rows: ...". `limits` are the server's.
  ScenePlayer(Session& session, const v1::Scene& scene, const v1::ServerInfo::Limits& limits);

  const v1::Scene& scene() const { return scene_; }
  const std::vector<PlayedCloth>& cloths() const { return cloths_; }
  uint64_t step() const { return step_; }
  uint64_t step_count() const { return step_count_; }

  // Does up to `steps` steps, as many as remain, in as many requests as controls and limits
  // require; one takes about half a second at most. `should_stop` is called after each request;
  // once it returns true, one more step is the last. `has_impulses`: only of servers with
  // ServerInfo.has_impulses. `has_contacts`: the last step is asked for contact impulses, which
  // pictures by CONTACT show.
  AdvanceResult Advance(uint64_t steps, bool has_reports,
                        const std::function<bool()>& should_stop = nullptr,
                        bool has_impulses = false, bool has_contacts = false);

 private:
  void CreateEntry(int entry);
  // Best effort.
  void DeleteCreated();
  // Moves pins, colliders and rest lengths through `request`, and updates gravity and wind at once,
  // for the controls that start now.
  void ApplyControls(v1::StepRequest* request);
  void SetEnvironment(const v1::SceneControl& control);
  std::vector<ClothId> ControlledIds(const v1::SceneControl& control) const;
  // The next step at which a control starts, or the end.
  uint64_t NextControlStep() const;
  void AdaptRequests(uint64_t steps, double wait_s);

  Session& session_;
  const v1::Scene scene_;
  const v1::ServerInfo::Limits limits_;
  const uint64_t step_count_;
  std::vector<PlayedCloth> cloths_;
  uint64_t step_ = 0;
  uint64_t steps_per_request_ = 1;  // at most; follows the time that requests take
};

}  // namespace client
}  // namespace drape
