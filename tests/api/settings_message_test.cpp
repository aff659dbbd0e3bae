// The table of settings agrees with the protocol.
#include "server/api/settings_message.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace drape::api {
namespace {

using google::protobuf::FieldDescriptor;

template <class Value>
FieldDescriptor::CppType TypeOf(const Setting<Value>&) {
  if (std::is_same_v<Value, double>) return FieldDescriptor::CPPTYPE_DOUBLE;
  if (std::is_same_v<Value, uint32_t>) return FieldDescriptor::CPPTYPE_UINT32;
  if (std::is_same_v<Value, bool>) return FieldDescriptor::CPPTYPE_BOOL;
  return FieldDescriptor::CPPTYPE_ENUM;
}

TEST(SettingsTable, HasTheFieldsOfTheProtocol) {
  const google::protobuf::Descriptor& message = *v1::StepSettings::descriptor();
  EXPECT_EQ(static_cast<size_t>(message.field_count()), std::tuple_size_v<decltype(kSettings)>);
  ForEachSetting([&](const auto& setting) {
    SCOPED_TRACE(setting.name);
    const FieldDescriptor* field = message.FindFieldByName(std::string(setting.name));
    ASSERT_NE(field, nullptr);
    EXPECT_EQ(field->cpp_type(), TypeOf(setting));
    if (field->enum_type() == nullptr) {
      EXPECT_TRUE(field->has_presence());
      return;
    }
    ASSERT_EQ(static_cast<size_t>(field->enum_type()->value_count()),
              setting.value_names.size() + 1);
    for (size_t k = 0; k < setting.value_names.size(); ++k) {
      EXPECT_EQ(field->enum_type()->value(static_cast<int>(k) + 1)->name(), setting.value_names[k]);
    }
  });
}

TEST(SettingsMessage, ReadsBackAsWritten) {
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime, Preset::kAccurate}) {
    Violations violations;
    EXPECT_EQ(CheckSettings("settings", ToProto(PresetSettings(preset)), violations),
              PresetSettings(preset));
    EXPECT_TRUE(violations.is_empty());
  }
}

TEST(SettingsMessage, WhatIsNotSetIsThePresets) {
  v1::StepSettings message;
  message.set_preset(v1::StepSettings::ACCURATE);
  message.set_use_tethers(true);
  message.set_spring_integration(v1::StepSettings::SPRING_INTEGRATION_UNSPECIFIED);
  StepSettings expected = PresetSettings(Preset::kAccurate);
  expected.use_tethers = true;
  Violations violations;
  EXPECT_EQ(CheckSettings("settings", message, violations), expected);
}

TEST(SettingsMessage, UnknownValuesOfEnumsAreNamed) {
  v1::StepSettings message;
  message.set_integration(static_cast<v1::StepSettings::Integration>(77));
  Violations violations;
  EXPECT_EQ(CheckSettings("settings", message, violations), StepSettings());
  ASSERT_EQ(violations.count(), 1u);
  EXPECT_EQ(violations.ToStatus().message(),
            "settings.integration: 77 is not a known value of Integration (ONE_STEP, TWO_STEP)");
}

}  // namespace
}  // namespace drape::api
