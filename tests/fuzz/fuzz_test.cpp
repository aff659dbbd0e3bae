// Spoiled bytes through parsing and validation: no crash, no hang, and either values within the
// limits or an error that names a field. The mutations are pseudo-random with a fixed seed, so a
// failure repeats; run under AddressSanitizer with the preset "asan".
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "server/api/picture_validation.h"
#include "server/api/request_validation.h"
#include "server/api/status_mapping.h"
#include "tests/api/requests.h"

namespace drape::test {
namespace {

constexpr int kRounds = 4000;
// Unparsable, refused and accepted requests: fewer would mean that the mutations miss their aim.
constexpr int kMinOfEach = 20;

// Changes, removes, repeats or inserts a few bytes.
class Mutator {
 public:
  explicit Mutator(uint32_t seed) : random_(seed) {}

  std::string Mutate(std::string bytes) {
    const uint32_t changes = 1 + Below(4);
    for (uint32_t k = 0; k < changes && !bytes.empty(); ++k) MutateOnce(bytes);
    return bytes;
  }
  uint32_t Below(size_t bound) { return static_cast<uint32_t>(random_() % bound); }

 private:
  void MutateOnce(std::string& bytes) {
    // Boundaries of varints, signs and exponents cause most surprises.
    static const std::string kBytes("\x00\x01\x7F\x80\xFF\xF0\xF8\x3F", 8);
    const size_t at = Below(bytes.size());
    const size_t length = 1 + Below(std::min<size_t>(bytes.size() - at, 16));
    switch (Below(5)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << Below(8)));
        break;
      case 1:
        bytes[at] = kBytes[Below(kBytes.size())];
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        bytes.insert(at, std::string(length, kBytes[Below(kBytes.size())]));
        break;
    }
  }

  std::mt19937 random_;
};

// How often each kind of outcome occurred: the test must reach all of them.
struct Outcomes {
  int unparsable = 0;
  int refused = 0;
  int accepted = 0;

  void ExpectAll() const {
    EXPECT_GE(unparsable, kMinOfEach);
    EXPECT_GE(refused, kMinOfEach);
    EXPECT_GE(accepted, kMinOfEach);
  }
};

void ExpectClearRefusal(const Status& status) {
  ASSERT_EQ(status.code(), StatusCode::kInvalidArgument);
  ASSERT_FALSE(status.violations().empty());
  for (const FieldViolation& violation : status.violations()) {
    EXPECT_FALSE(violation.field.empty() || violation.description.empty());
  }
  const grpc::Status mapped = api::ToGrpcStatus(status);
  EXPECT_LT(mapped.error_message().size() + mapped.error_details().size(), 8000u);
}

template <class Request, class Check>
Outcomes Fuzz(const std::vector<Request>& seeds, uint32_t seed, Check check) {
  const google::protobuf::LogSilencer silencer;  // it reports every text that is not UTF-8
  Mutator mutator(seed);
  Outcomes outcomes;
  for (int round = 0; round < kRounds; ++round) {
    const Request& good = seeds[mutator.Below(seeds.size())];
    Request request;
    if (!request.ParseFromString(mutator.Mutate(good.SerializeAsString()))) {
      ++outcomes.unparsable;
      continue;
    }
    const Status status = check(request);
    status.ok() ? ++outcomes.accepted : ++outcomes.refused;
    if (!status.ok()) ExpectClearRefusal(status);
  }
  return outcomes;
}

std::vector<v1::CreateClothsRequest> Creations() {
  std::vector<v1::CreateClothsRequest> creations(3, GoodCreation());
  Mesh(creations[1]);
  Chain(creations[2]);
  return creations;
}

// The builder accepts every accepted request, or refuses it with a field of its own.
TEST(RequestFuzz, CreateCloths) {
  api::RequestLimits limits;
  limits.model.max_particles = 4096;
  limits.max_cloths_per_request = 64;
  const auto check = [&](const v1::CreateClothsRequest& request) -> Status {
    const auto checked = api::CheckCreateCloths(request, limits);
    if (!checked.ok()) return checked.status();
    EXPECT_LE(checked->copies.size(), limits.max_cloths_per_request);
    for (const ClothCopy& copy : checked->copies) {
      EXPECT_TRUE(copy.parameters.gravity_m_per_s2.allFinite());
      EXPECT_TRUE(copy.parameters.wind_m_per_s.allFinite());
      EXPECT_GE(copy.parameters.air_drag, 0);
      EXPECT_GE(copy.parameters.air_lift, 0);
      EXPECT_NEAR(copy.transform.rotation.norm(), 1, 1e-12);
    }
    return SceneModel::Build(*checked->description, limits.model).status();
  };
  Fuzz(Creations(), 1, check).ExpectAll();
}

TEST(RequestFuzz, Step) {
  constexpr uint32_t kMaxSteps = 1000;
  const auto check = [](const v1::StepRequest& request) -> Status {
    const auto checked = api::CheckStep(request, kMaxSteps);
    if (!checked.ok()) return checked.status();
    EXPECT_TRUE(checked->steps.has_value() != checked->until_step.has_value());
    for (const ControlRow<PinControl>& row : checked->controls.pins) {
      EXPECT_TRUE(row.control.target_m.allFinite() && row.control.over_s >= 0);
    }
    for (const RigidTransform& transform : checked->resets.starts.transforms) {
      EXPECT_NEAR(transform.rotation.norm(), 1, 1e-12);
    }
    for (const ControlRow<GripControl>& row : checked->controls.grips) {
      EXPECT_TRUE(row.control.place_m.allFinite() && row.control.over_s >= 0);
      EXPECT_TRUE(row.control.action != GripAction::kGrabNearest || row.control.radius_m > 0);
    }
    const std::vector<uint32_t>& particles = checked->view.fields.particles;
    EXPECT_EQ(std::adjacent_find(particles.begin(), particles.end(), std::greater_equal<>()),
              particles.end());
    return Status::Ok();
  };
  Fuzz<v1::StepRequest>({GoodStep()}, 2, check).ExpectAll();
}

TEST(RequestFuzz, UpdateCloths) {
  v1::UpdateClothsRequest update;
  update.add_cloth_ids(1);
  *update.add_overrides() = GoodStep().resets().overrides(0);
  *update.mutable_spec() = GoodCreation().spec();
  for (const char* path : {"environment.gravity_m_per_s2", "environment.colliders", "pins",
                           "settings", "material.friction_static", "environment.wind_m_per_s",
                           "material.air_drag", "material.air_lift"}) {
    update.mutable_update_mask()->add_paths(path);
  }
  const auto check = [](const v1::UpdateClothsRequest& request) -> Status {
    return api::CheckUpdateCloths(request, {}).status();
  };
  Fuzz<v1::UpdateClothsRequest>({update}, 3, check).ExpectAll();
}

// Every accepted picture can be drawn: numbers are finite, directions have length 1.
TEST(RequestFuzz, Render) {
  v1::RenderRequest fitted = GoodPicture();
  fitted.clear_camera();
  Set(fitted.mutable_fit()->mutable_view_direction(), {1, -1, 0.5});
  Set(fitted.mutable_fit()->mutable_include_m(), {-1, -1, -1, 1, 2, 3});
  const auto check = [](const v1::RenderRequest& request) -> Status {
    const auto spec = api::CheckRender(request);
    if (!spec.ok()) return spec.status();
    EXPECT_TRUE(spec->width_px >= 16 && spec->width_px <= 4096);
    EXPECT_TRUE(spec->height_px >= 16 && spec->height_px <= 4096);
    EXPECT_NEAR(spec->view_direction.norm(), 1, 0.01);
    if (spec->camera) {
      const render::Camera& camera = *spec->camera;
      EXPECT_NEAR(camera.up.norm(), 1, 1e-12);
      EXPECT_GE(camera.up.cross((camera.target_m - camera.eye_m).normalized()).norm(), 0.9e-3);
    }
    if (spec->range) {
      EXPECT_LT(static_cast<float>(spec->range->low), static_cast<float>(spec->range->high));
    }
    return Status::Ok();
  };
  Fuzz<v1::RenderRequest>({GoodPicture(), fitted}, 4, check).ExpectAll();
}

}  // namespace
}  // namespace drape::test
