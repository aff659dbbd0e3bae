// Bad input of every kind against one server, which steps a good scene first and last: the same
// bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <limits>
#include <thread>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The objects that a case may use: a session with one cloth, and another session with one.
struct Stage {
  Stub& stub;
  std::string session;
  uint64_t cloth = 0;
  std::string other_session;
  uint64_t other_cloth = 0;
};

struct BadCall {
  std::string name;
  std::function<grpc::Status(Stage&)> call;
  grpc::StatusCode code;
  // A field of BadRequest, or the reason of ErrorInfo.
  std::string field_or_reason;
  std::string text;  // part of the message
};

// CreateCloths of the good request, spoiled.
BadCall Creating(const std::string& name,
                 const std::function<void(v1::CreateClothsRequest&)>& spoil,
                 const std::string& field, const std::string& text) {
  const auto call = [spoil](Stage& stage) {
    v1::CreateClothsRequest request = GoodCreation();
    request.set_session(stage.session);
    spoil(request);
    return Call(stage.stub, &Stub::CreateCloths, request).status;
  };
  return {name, call, grpc::StatusCode::INVALID_ARGUMENT, field, text};
}

BadCall Stepping(const std::string& name,
                 const std::function<void(Stage&, v1::StepRequest&)>& spoil, grpc::StatusCode code,
                 const std::string& field_or_reason, const std::string& text) {
  const auto call = [spoil](Stage& stage) {
    v1::StepRequest request = StepsOf(stage.session, {stage.cloth}, 1);
    spoil(stage, request);
    return Call(stage.stub, &Stub::Step, request).status;
  };
  return {name, call, code, field_or_reason, text};
}

BadCall Updating(const std::string& name, const std::string& path,
                 const std::function<void(v1::ClothSpec&)>& spoil, const std::string& field,
                 const std::string& text) {
  const auto call = [path, spoil](Stage& stage) {
    v1::UpdateClothsRequest request;
    request.set_session(stage.session);
    request.add_cloth_ids(stage.cloth);
    request.mutable_update_mask()->add_paths(path);
    spoil(*request.mutable_spec());
    return Call(stage.stub, &Stub::UpdateCloths, request).status;
  };
  return {name, call, grpc::StatusCode::INVALID_ARGUMENT, field, text};
}

std::vector<BadCall> BadCreations() {
  return {
      Creating(
          "wrong pin index", [](auto& r) { Spec(r).mutable_pins(0)->set_particle(12); },
          "spec.pins[0].particle", "12"),
      Creating(
          "wrong constraint index",
          [](auto& r) { Chain(r).mutable_distance_constraints(0)->set_i(7); },
          "spec.particles.distance_constraints[0].i", "7"),
      Creating(
          "NaN position", [](auto& r) { Chain(r).set_positions_m(4, kNaN); },
          "spec.particles.positions_m[1]", "nan"),
      Creating(
          "NaN mass", [](auto& r) { Chain(r).set_masses_kg(0, kNaN); },
          "spec.particles.masses_kg[0]", "nan"),
      Creating(
          "infinite mass", [](auto& r) { Chain(r).set_masses_kg(0, kInfinity); },
          "spec.particles.masses_kg[0]", "inf"),
      Creating(
          "negative mass", [](auto& r) { Chain(r).set_masses_kg(0, -2); },
          "spec.particles.masses_kg[0]", "-2"),
      Creating(
          "zero-size grid", [](auto& r) { BareSpec(r).mutable_grid()->set_columns(0); },
          "spec.grid.columns", "0"),
      Creating(
          "10^9 particles",
          [](auto& r) {
            BareSpec(r).mutable_grid()->set_columns(50000);
            Spec(r).mutable_grid()->set_rows(20000);
          },
          "spec.grid.columns", "1000000000"),
      Creating(
          "short vector",
          [](auto& r) { Spec(r).mutable_transform()->mutable_position_m()->RemoveLast(); },
          "spec.transform.position_m", "has 2 elements"),
      Creating(
          "short positions", [](auto& r) { Chain(r).mutable_positions_m()->RemoveLast(); },
          "spec.particles.positions_m", "multiple of 3"),
      Creating(
          "unknown preset",
          [](auto& r) {
            Spec(r).mutable_settings()->set_preset(static_cast<v1::StepSettings::Preset>(77));
          },
          "spec.settings.preset", "77"),
      Creating(
          "mesh without triangles",
          [](auto& r) {
            *Mesh(r).mutable_triangles() = Packed<uint32_t>(v1::PackedArray::UINT32, 3, {});
          },
          "spec.mesh.triangles", "0 triangles"),
      Creating(
          "mesh without area",
          [](auto& r) {
            *Mesh(r).mutable_triangles() = Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 1, 1});
          },
          "spec.mesh.triangles", "no area"),
      Creating(
          "time step 0", [](auto& r) { Spec(r).mutable_settings()->set_time_step_s(0); },
          "spec.settings.time_step_s", "(0, 10]"),
      Creating(
          "negative time step", [](auto& r) { Spec(r).mutable_settings()->set_time_step_s(-0.1); },
          "spec.settings.time_step_s", "-0.1"),
      Creating(
          "zero quaternion", [](auto& r) { r.set_transforms(6, 0); }, "transforms[3]",
          "not a rotation"),
  };
}

std::vector<BadCall> BadSteps() {
  using grpc::StatusCode;
  return {
      Stepping(
          "unknown cloth", [](Stage&, auto& r) { r.set_cloth_ids(0, 1234567); },
          StatusCode::NOT_FOUND, "CLOTH_NOT_FOUND", "1234567"),
      Stepping(
          "another session's cloth",
          [](Stage& stage, auto& r) { r.set_cloth_ids(0, stage.other_cloth); },
          StatusCode::NOT_FOUND, "CLOTH_NOT_FOUND", ""),
      Stepping(
          "unknown session", [](Stage&, auto& r) { r.set_session("sessions/nobody"); },
          StatusCode::NOT_FOUND, "SESSION_NOT_FOUND", ""),
      Stepping(
          "cloth twice", [](Stage& stage, auto& r) { r.add_cloth_ids(stage.cloth); },
          StatusCode::INVALID_ARGUMENT, "cloth_ids[1]", ""),
      Stepping(
          "no steps", [](Stage&, auto& r) { r.set_steps(0); }, StatusCode::INVALID_ARGUMENT,
          "steps", "[1, "),
      Stepping(
          "wrong expected step", [](Stage&, auto& r) { r.set_expected_step(99); },
          StatusCode::FAILED_PRECONDITION, "STEP_MISMATCH", "99"),
      Stepping(
          "control of no pin",
          [](Stage& stage, auto& r) {
            r.mutable_pin_controls()->add_cloth_ids(stage.cloth);
            r.mutable_pin_controls()->add_particles(63);
            Set(r.mutable_pin_controls()->mutable_targets_m(), {0, 0, 0});
          },
          StatusCode::INVALID_ARGUMENT, "pin_controls.particles[0]", "63"),
      Stepping(
          "control of a cloth outside the request",
          [](Stage& stage, auto& r) {
            r.mutable_pin_controls()->add_cloth_ids(stage.other_cloth);
            r.mutable_pin_controls()->add_particles(0);
            Set(r.mutable_pin_controls()->mutable_targets_m(), {0, 0, 0});
          },
          StatusCode::INVALID_ARGUMENT, "pin_controls.cloth_ids[0]", ""),
      Stepping(
          "infinite target",
          [](Stage& stage, auto& r) {
            r.mutable_pin_controls()->add_cloth_ids(stage.cloth);
            r.mutable_pin_controls()->add_particles(0);
            Set(r.mutable_pin_controls()->mutable_targets_m(), {0, kInfinity, 0});
          },
          StatusCode::INVALID_ARGUMENT, "pin_controls.targets_m[1]", "inf"),
      Updating(
          "unknown path", "material.colour", [](auto&) {}, "update_mask.paths[0]",
          "'material.colour'"),
      Updating(
          "wrong new pin", "pins", [](auto& spec) { spec.add_pins()->set_particle(64); },
          "spec.pins[0].particle", "64"),
      Updating(
          "infinite gravity", "environment.gravity_m_per_s2",
          [](auto& spec) {
            Set(spec.mutable_environment()->mutable_gravity_m_per_s2(), {0, kInfinity, 0});
          },
          "spec.environment.gravity_m_per_s2[1]", "inf"),
      Updating(
          "wind that is no number", "environment.wind_m_per_s",
          [](auto& spec) {
            Set(spec.mutable_environment()->mutable_wind_m_per_s(), {0, 0, kNaN});
          },
          "spec.environment.wind_m_per_s[2]", "nan"),
      Updating(
          "negative drag", "material.air_drag",
          [](auto& spec) { spec.mutable_material()->set_air_drag(-0.5); }, "spec.material.air_drag",
          "-0.5"),
      Updating(
          "restitution that is no number", "material.restitution",
          [](auto& spec) { spec.mutable_material()->set_restitution(kNaN); },
          "spec.material.restitution", "nan"),
      Updating(
          "dynamic above static friction", "material.friction_dynamic",
          [](auto& spec) { spec.mutable_material()->set_friction_dynamic(0.5); },
          "spec.material.friction_dynamic", "0.5"),
  };
}

std::vector<BadCall> OtherBadCalls() {
  using grpc::StatusCode;
  const auto create_session = [](double ttl_s) {
    return [ttl_s](Stage& stage) {
      v1::CreateSessionRequest request;
      request.set_ttl_s(ttl_s);
      return Call(stage.stub, &Stub::CreateSession, request).status;
    };
  };
  const auto delete_nothing = [](Stage& stage) {
    v1::DeleteClothsRequest request;
    request.set_session(stage.session);
    return Call(stage.stub, &Stub::DeleteCloths, request).status;
  };
  const auto bad_token = [](Stage& stage) {
    v1::ListClothsRequest request;
    request.set_session(stage.session);
    request.set_page_token("next");
    return Call(stage.stub, &Stub::ListCloths, request).status;
  };
  const auto expired = [](Stage& stage) {
    const std::string name = NewSession(stage.stub, 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    return Call(stage.stub, &Stub::Step, StepsOf(name, {}, 1)).status;
  };
  const auto too_large = [](Stage& stage) {
    v1::CreateClothsRequest request = GoodCreation();
    request.set_session(stage.session);
    Mesh(request).mutable_positions_m()->mutable_data()->resize(65u << 20);
    return Call(stage.stub, &Stub::CreateCloths, request).status;
  };
  return {
      {"no lease", create_session(0), StatusCode::INVALID_ARGUMENT, "ttl_s", "[1, 86400] s"},
      {"NaN lease", create_session(kNaN), StatusCode::INVALID_ARGUMENT, "ttl_s", "nan"},
      {"delete nothing", delete_nothing, StatusCode::INVALID_ARGUMENT, "cloth_ids", "empty"},
      {"bad page token", bad_token, StatusCode::INVALID_ARGUMENT, "page_token", ""},
      {"expired session", expired, StatusCode::NOT_FOUND, "SESSION_EXPIRED", ""},
      // The transport's own error: it has a message, no details.
      {"request too large", too_large, StatusCode::RESOURCE_EXHAUSTED, "", "67108864"},
  };
}

void ExpectRefused(const BadCall& bad, Stage& stage) {
  const grpc::Status status = bad.call(stage);
  EXPECT_EQ(status.error_code(), bad.code) << status.error_message();
  EXPECT_THAT(status.error_message(), testing::HasSubstr(bad.text));
  if (bad.code == grpc::StatusCode::INVALID_ARGUMENT) {
    EXPECT_THAT(FieldsOf(status), testing::Contains(bad.field_or_reason)) << status.error_message();
    EXPECT_THAT(status.error_message(), testing::HasSubstr(bad.field_or_reason));
  } else {
    EXPECT_EQ(ReasonOf(status), bad.field_or_reason);
  }
}

TEST(BadInput, IsRefusedAndTheServerGoesOnWithTheSameBits) {
  ServerProcess server({"--reap-interval-ms=10"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  Stage stage{*stub, NewSession(*stub), 0, NewSession(*stub), 0};
  stage.cloth = Create(*stub, HangingSheet(stage.session)).at(0);
  stage.other_cloth = Create(*stub, HangingSheet(stage.other_session)).at(0);
  Step(*stub, StepsOf(stage.session, {stage.cloth}, 5));
  const std::string before = Bits(*stub, stage.session, {stage.cloth});
  const v1::Cloth cloth_before = Get(*stub, stage.session, stage.cloth);

  for (const auto& table : {BadCreations(), BadSteps(), OtherBadCalls()}) {
    for (const BadCall& bad : table) {
      SCOPED_TRACE(bad.name);
      ExpectRefused(bad, stage);
    }
  }

  // Nothing has changed, nothing is left over, and the same scene gives the same bits.
  EXPECT_EQ(Bits(*stub, stage.session, {stage.cloth}), before);
  EXPECT_EQ(Get(*stub, stage.session, stage.cloth).SerializeAsString(),
            cloth_before.SerializeAsString());
  const uint64_t again = Create(*stub, HangingSheet(stage.session)).at(0);
  Step(*stub, StepsOf(stage.session, {again}, 5));
  EXPECT_EQ(Bits(*stub, stage.session, {again}), before);
  const auto info = Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest());
  EXPECT_EQ(info.value.cloth_count(), 3u);
  EXPECT_EQ(info.value.session_count(), 2u);
  EXPECT_TRUE(server.is_running());
}

}  // namespace
}  // namespace drape::test
