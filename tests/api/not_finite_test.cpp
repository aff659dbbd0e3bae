// Every number of every request that changes cloths, one after the other, as NaN and as infinity:
// refused by its name. The test finds the fields by reflection, so it includes new ones.
#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "server/api/request_validation.h"
#include "tests/api/requests.h"

namespace drape::test {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNotFinite[] = {std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity};

class NotFiniteTest : public testing::Test {
 protected:
  // `check` looks at the request that `message` is part of.
  void SpoilEach(Message& message, const std::string& path, const std::function<Status()>& check) {
    for (int k = 0; k < message.GetDescriptor()->field_count(); ++k) {
      const FieldDescriptor& field = *message.GetDescriptor()->field(k);
      const std::string name = path + "." + field.name();
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)
        SpoilNumbers(message, field, name, check);
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
        Descend(message, field, name, check);
    }
  }

  int refused_ = 0;

 private:
  void SpoilNumbers(Message& message, const FieldDescriptor& field, const std::string& name,
                    const std::function<Status()>& check) {
    const Reflection& reflection = *message.GetReflection();
    for (const double value : kNotFinite) {
      if (!field.is_repeated()) {
        const bool was_set = reflection.HasField(message, &field);
        const double good = reflection.GetDouble(message, &field);
        reflection.SetDouble(&message, &field, value);
        ExpectRefused(check(), name, field.name());
        reflection.SetDouble(&message, &field, good);
        if (!was_set) reflection.ClearField(&message, &field);
        continue;
      }
      for (int at = 0; at < reflection.FieldSize(message, &field); ++at) {
        const double good = reflection.GetRepeatedDouble(message, &field, at);
        reflection.SetRepeatedDouble(&message, &field, at, value);
        ExpectRefused(check(), name + "[" + std::to_string(at) + "]", field.name());
        reflection.SetRepeatedDouble(&message, &field, at, good);
      }
    }
  }

  // Visits the fields that are set, and those that can be set without replacing another one.
  void Descend(Message& message, const FieldDescriptor& field, const std::string& name,
               const std::function<Status()>& check) {
    const Reflection& reflection = *message.GetReflection();
    if (field.is_repeated()) {
      for (int at = 0; at < reflection.FieldSize(message, &field); ++at) {
        SpoilEach(*reflection.MutableRepeatedMessage(&message, &field, at),
                  name + "[" + std::to_string(at) + "]", check);
      }
      return;
    }
    const bool was_set = reflection.HasField(message, &field);
    if (!was_set && field.containing_oneof() != nullptr) return;
    SpoilEach(*reflection.MutableMessage(&message, &field), name, check);
    if (!was_set) reflection.ClearField(&message, &field);
  }

  void ExpectRefused(const Status& status, const std::string& name, const std::string& field) {
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << name;
    bool is_named = false;
    for (const FieldViolation& violation : status.violations()) {
      is_named |= violation.field.find(field) != std::string::npos;
    }
    EXPECT_TRUE(is_named) << name << ": " << status.ToString();
    ++refused_;
  }
};

Status CheckCreation(const v1::CreateClothsRequest& request) {
  const auto checked = api::CheckCreateCloths(request, {});
  if (!checked.ok()) return checked.status();
  return SceneModel::Build(*checked->description).status();
}

TEST_F(NotFiniteTest, CreateCloths) {
  std::vector<v1::CreateClothsRequest> creations(2, GoodCreation());
  Chain(creations[1]);
  for (v1::CreateClothsRequest& creation : creations) {
    ASSERT_TRUE(CheckCreation(creation).ok()) << CheckCreation(creation).ToString();
    SpoilEach(creation, "request", [&] { return CheckCreation(creation); });
  }
  EXPECT_GT(refused_, 2 * 3 * 70) << "as many numbers as that are in the two requests";
}

TEST_F(NotFiniteTest, PositionsOfMeshes) {
  v1::CreateClothsRequest creation = GoodCreation();
  const std::string good = Mesh(creation).positions_m().data();
  ASSERT_TRUE(CheckCreation(creation).ok());
  for (size_t at = 0; at < good.size(); at += sizeof(float)) {
    for (const double value : kNotFinite) {
      const auto number = static_cast<float>(value);
      std::string spoiled = good;
      std::memcpy(spoiled.data() + at, &number, sizeof(number));
      Spec(creation).mutable_mesh()->mutable_positions_m()->set_data(spoiled);
      EXPECT_EQ(CheckCreation(creation).code(), StatusCode::kInvalidArgument) << "byte " << at;
    }
  }
}

TEST_F(NotFiniteTest, UpdateCloths) {
  v1::UpdateClothsRequest update;
  update.add_cloth_ids(1);
  *update.mutable_spec() = GoodCreation().spec();
  update.mutable_spec()->clear_grid();
  update.mutable_spec()->clear_transform();
  for (const char* path :
       {"environment.gravity_m_per_s2", "environment.colliders", "environment.wind_m_per_s", "pins",
        "settings", "material.friction_static", "material.friction_dynamic", "material.air_drag",
        "material.air_lift", "material.damping_per_s", "material.thickness_m"}) {
    update.mutable_update_mask()->add_paths(path);
  }
  const auto check = [&] { return api::CheckUpdateCloths(update, {}).status(); };
  ASSERT_TRUE(check().ok()) << check().ToString();
  SpoilEach(*update.mutable_spec()->mutable_environment(), "environment", check);
  SpoilEach(*update.mutable_spec()->mutable_settings(), "settings", check);
  for (v1::Pin& pin : *update.mutable_spec()->mutable_pins()) SpoilEach(pin, "pin", check);
  EXPECT_GT(refused_, 3 * 30);
}

TEST_F(NotFiniteTest, Step) {
  v1::StepRequest step = GoodStep();
  const auto check = [&] { return api::CheckStep(step, 1000).status(); };
  ASSERT_TRUE(check().ok()) << check().ToString();
  SpoilEach(step, "request", check);
  EXPECT_GT(refused_, 3 * 5);
}

}  // namespace
}  // namespace drape::test
