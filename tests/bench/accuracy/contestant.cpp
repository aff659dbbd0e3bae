#include "tests/bench/accuracy/contestant.h"
#include "server/solver/load.h"

#include "tests/support/states.h"

namespace drape::bench {
namespace {

class Cloth final : public Contestant {
 public:
  Cloth(Backend& backend, const test::Scene& scene, const StepSettings& settings)
      : backend_(backend), scene_(scene) {
    scene_.parameters.settings = settings;
    scene_.parameters = RaiseSubsteps(*scene_.model, scene_.parameters);  // as the server does
    cloth_ = test::CreateCloth(backend_, scene_);
  }
  ~Cloth() override { backend_.Destroy(cloth_); }

  // A new cloth: it also drops everything that a backend keeps from step to step.
  void Restart() override {
    backend_.Destroy(cloth_);
    cloth_ = test::CreateCloth(backend_, scene_);
  }

  FrameReport Step() override {
    const StepItem item{cloth_, {}, false};
    const StepReport report = backend_.Step({&item, 1}).reports.at(0);
    return {report.iterations, report.fault != FaultReason::kNone};
  }

  ParticleState State() override { return test::ReadState(backend_, cloth_); }

 private:
  Backend& backend_;
  test::Scene scene_;
  ClothHandle cloth_;
};

}  // namespace

std::unique_ptr<Contestant> MakeContestant(Backend& backend, const test::Scene& scene,
                                           const StepSettings& settings) {
  return std::make_unique<Cloth>(backend, scene, settings);
}

}  // namespace drape::bench
