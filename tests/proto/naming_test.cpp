// The rules of proto/README.md, held by every message, field, enum and method.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <string>

#include "tests/proto/descriptors.h"

namespace drape::test {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

class Naming : public testing::Test {
 protected:
  const Descriptors descriptors_;
};

bool Matches(const std::string& name, const char* pattern) {
  return std::regex_match(name, std::regex(pattern));
}

TEST_F(Naming, FilesSayProto3AndThePackage) {
  ASSERT_GE(descriptors_.Files().size(), 5u);
  for (const auto* file : descriptors_.Files()) {
    EXPECT_EQ(file->syntax(), google::protobuf::FileDescriptor::SYNTAX_PROTO3) << file->name();
    EXPECT_TRUE(Matches(file->name(), "drape/v1/[a-z_]+\\.proto")) << file->name();
  }
}

TEST_F(Naming, MessagesAndMethodsArePascalCase) {
  for (const Descriptor* message : descriptors_.Messages()) {
    EXPECT_TRUE(Matches(message->name(), "([A-Z][a-z0-9]+)+")) << message->full_name();
  }
  for (const auto* method : descriptors_.Methods()) {
    EXPECT_TRUE(Matches(method->name(), "([A-Z][a-z0-9]+)+")) << method->full_name();
  }
}

TEST_F(Naming, FieldsAreSnakeCase) {
  for (const Descriptor* message : descriptors_.Messages()) {
    for (int k = 0; k < message->field_count(); ++k) {
      EXPECT_TRUE(Matches(message->field(k)->name(), "[a-z]+(_[a-z0-9]+)*"))
          << message->field(k)->full_name();
    }
  }
}

// Enum values are bare (`REALTIME`), but zero is always <ENUM>_UNSPECIFIED.
TEST_F(Naming, EnumsAreUpperSnakeCaseWithAnUnspecifiedZero) {
  ASSERT_FALSE(descriptors_.Enums().empty());
  for (const auto* type : descriptors_.Enums()) {
    const std::string upper =
        std::regex_replace(type->name(), std::regex("([a-z])([A-Z])"), "$1_$2");
    std::string zero = upper + "_UNSPECIFIED";
    std::transform(zero.begin(), zero.end(), zero.begin(), ::toupper);
    EXPECT_EQ(type->FindValueByNumber(0)->name(), zero) << type->full_name();
    EXPECT_GE(type->value_count(), 3) << type->full_name() << " offers no choice";
    for (int k = 0; k < type->value_count(); ++k) {
      EXPECT_TRUE(Matches(type->value(k)->name(), "[A-Z][A-Z0-9]*(_[A-Z0-9]+)*"))
          << type->value(k)->full_name();
    }
  }
}

// A real number carries its SI unit, or is one of these pure numbers.
TEST_F(Naming, RealNumbersCarryTheirUnit) {
  const std::set<std::string> kPureNumbers = {"friction_static",
                                              "friction_dynamic",
                                              "air_drag",
                                              "air_lift",
                                              "restitution",
                                              "described_error",
                                              "start_error",
                                              "max_error",
                                              "rms_error",
                                              "largest_let_out",
                                              "least_share",
                                              "load_limit",
                                              "refine_above_strain",
                                              "tolerance",
                                              "max_strain",
                                              "rms_strain",
                                              "strain_p50",
                                              "strain_p90",
                                              "strain_p99",
                                              "normal",
                                              "transforms",
                                              "rotation_xyzw",
                                              "rotations_xyzw",
                                              "max_solves_per_step",
                                              "view_direction",
                                              "warp_direction",
                                              "up",
                                              "scale",
                                              "scales",
                                              "starts",  // of various quantities, as goals
                                              "goals",
                                              "measurements",
                                              "range"};  // of the quantity that the colours show
  const char* kUnits =
      ".*_(m|m2|kg|n|s|ms|us|hz|j|rad|m_per_s|m_per_s2|kg_per_m2|kg_per_m3|n_per_m|n_s_per_m|m_per_"
      "n|"
      "per_s)";
  for (const Descriptor* message : descriptors_.Messages()) {
    for (int k = 0; k < message->field_count(); ++k) {
      const FieldDescriptor* field = message->field(k);
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT) {
        ADD_FAILURE() << field->full_name() << ": numbers are double";
      }
      if (field->cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE) continue;
      EXPECT_TRUE(Matches(field->name(), kUnits) || kPureNumbers.count(field->name()) > 0)
          << field->full_name() << " has no unit";
    }
  }
}

TEST_F(Naming, ListsArePlural) {
  // Vectors are one value of several numbers; x, y, z are not counted.
  const char* kVectors =
      "gravity_.*|center_m|point_m|other_point_m|a_m|b_m|normal|position_m|rotation_xyzw|target_m|"
      "environment_origin_m|over_s|shape|eye_m|up|view_direction|include_m|range|wind_.*|"
      "rotations_xyzw|velocity_m_per_s|angular_velocity_rad_per_s|pivot_m|warp_direction";
  for (const Descriptor* message : descriptors_.Messages()) {
    for (int k = 0; k < message->field_count(); ++k) {
      const FieldDescriptor* field = message->field(k);
      if (!field->is_repeated() || Matches(field->name(), kVectors)) continue;
      EXPECT_TRUE(Matches(field->name(), "[a-z_]*(s|radii)(_m|_m2|_n|_kg|_s|_m_per_s)?"))
          << field->full_name();
    }
  }
}

TEST_F(Naming, MethodsTakeTheirOwnRequest) {
  const auto methods = descriptors_.Methods();
  ASSERT_FALSE(methods.empty());
  std::set<std::string> requests;
  for (const auto* method : methods) {
    const std::string request = method->input_type()->name();
    // These stream the requests or the answers of Step.
    const bool is_step = method->name() == "StepStream" || method->name() == "StepInChunks";
    const std::string expected = (is_step ? "Step" : method->name()) + "Request";
    EXPECT_EQ(request, expected) << method->full_name();
    requests.insert(request);
  }
  EXPECT_EQ(requests.size() + 2, methods.size());
}

// Every message is part of some request or answer, of a file of the server, or of the scene file,
// where the client looks for the fields of MeshFile itself.
TEST_F(Naming, NoMessageIsUnused) {
  std::set<const Descriptor*> used;
  std::vector<const Descriptor*> open = {
      descriptors_.Message("Scene"),          descriptors_.Message("MeshFile"),
      descriptors_.Message("SnapshotHeader"), descriptors_.Message("ModelSnapshot"),
      descriptors_.Message("ClothSnapshot"),  descriptors_.Message("SessionCheckpoint")};
  for (const auto* method : descriptors_.Methods()) {
    open.push_back(method->input_type());
    open.push_back(method->output_type());
  }
  while (!open.empty()) {
    const Descriptor* message = open.back();
    open.pop_back();
    if (!used.insert(message).second) continue;
    for (int k = 0; k < message->field_count(); ++k) {
      if (const Descriptor* type = message->field(k)->message_type()) open.push_back(type);
    }
  }
  for (const Descriptor* message : descriptors_.Messages()) {
    EXPECT_TRUE(used.count(message)) << message->full_name() << " is not used";
  }
}

}  // namespace
}  // namespace drape::test
