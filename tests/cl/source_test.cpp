// Kernel sources with their includes put in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "host/cl/device.hpp"
#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
using testing::Not;

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(KernelSource, EmbeddedFilesAreThoseOfTheSourceTree) {
  std::vector<std::string> expected;
  const std::filesystem::path folder = std::filesystem::path(CLERESTORY_SOURCE_DIR) / "kernels";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".cl" || entry.path().extension() == ".clh")
      expected.push_back(std::filesystem::relative(entry.path(), folder).string());
  std::ranges::sort(expected);
  EXPECT_EQ(kernel_files(), expected);
}

TEST(KernelSource, PutsIncludesInWithLineMarks) {
  const std::string source = kernel_source("tensor/accumulate.cl");
  EXPECT_THAT(source, HasSubstr("#line 1 \"tensor/accumulate.cl\""));
  EXPECT_THAT(source, HasSubstr("#line 1 \"lib/real.clh\""));
  EXPECT_THAT(source, HasSubstr("typedef float real;"));
  EXPECT_THAT(source, HasSubstr("kernel void accumulate"));
  EXPECT_THAT(source, Not(HasSubstr("#include")));
  EXPECT_THAT(source, Not(HasSubstr("#pragma once")));
}

TEST(KernelSource, LineMarksCountTheLinesOfTheIncludingFile) {
  ScopedFolder folder;
  folder.write("a.cl", "int first;\n#include \"b.clh\"\nint third;\n");
  folder.write("b.clh", "int other;\n");
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  const std::string a = folder.string() + "/a.cl", b = folder.string() + "/b.clh";
  EXPECT_EQ(kernel_source("a.cl"), "#line 1 \"" + a + "\"\nint first;\n#line 1 \"" + b + "\"\nint other;\n#line 3 \"" +
                                       a + "\"\nint third;\n");
}

TEST(KernelSource, TheHashIsOfAllThatIsRead) {
  const std::string embedded = kernels_hash();
  EXPECT_EQ(embedded.size(), 16u);
  ScopedFolder folder;
  std::filesystem::copy(std::filesystem::path(CLERESTORY_SOURCE_DIR) / "kernels", folder.path(),
                        std::filesystem::copy_options::recursive);
  ScopedVariable variable("CLERESTORY_KERNELS", folder.string());
  EXPECT_EQ(kernels_hash(), embedded);
  folder.write("lib/rng.clh", read_text(folder.path() / "lib/rng.clh") + "int more;");
  EXPECT_NE(kernels_hash(), embedded);
}

TEST(KernelSource, TheHashIsOfCodeNotOfCommentsAndBlanks) {
  ScopedFolder folder;
  std::filesystem::copy(std::filesystem::path(CLERESTORY_SOURCE_DIR) / "kernels", folder.path(),
                        std::filesystem::copy_options::recursive);
  ScopedVariable variable("CLERESTORY_KERNELS", folder.string());
  const auto hash_with = [&](const std::string& text) {
    folder.write("lib/rng.clh", text);
    return kernels_hash();
  };
  const std::string plain = hash_with("#define A \"b\"\nint a = 4 / 2;\n");
  EXPECT_EQ(hash_with("// why\n#define   A \"b\"  // \"so\n\n\t int a =\t4 / 2;  \n/* a\nb */\n"), plain);
  EXPECT_EQ(hash_with("#define A \"b\"\r\nint a =/* of */4 / 2; /* never closed"), plain);
  EXPECT_EQ(hash_with("#define A \"b\"\nint a = 4 / 2;"), plain);
  for (const char* other :
       {"#define A \"b \"\nint a = 4 / 2;\n", "#define A \"//\"\nint a = 4 / 2;\n", "#define A \"b\" int a = 4 / 2;\n",
        "#define A \"b\"\ninta = 4 / 2;\n", "#define A \"b\"\nint a = 4 // 2;\n", "#define A \"b\"\n"})
    EXPECT_NE(hash_with(other), plain) << other;
}

TEST(KernelSource, AKernelsHashIsOfWhatItIncludesAndOfNothingElse) {
  ScopedFolder folder;
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  folder.write("b.clh", "#pragma once\nint b;\n");
  folder.write("other.cl", "int other;\n");
  const auto hash_of = [&](const std::string& text) {
    folder.write("a.cl", text);
    return kernel_hash("a.cl");
  };
  const std::string text = "#include \"b.clh\"\nint a;\n", plain = hash_of(text);
  EXPECT_EQ(hash_of("// why\n\n" + text), plain);
  folder.write("other.cl", "int another;\n");
  EXPECT_EQ(hash_of(text), plain);
  folder.write("b.clh", "#pragma once\n/* why */ int b;\n");
  EXPECT_EQ(hash_of(text), plain);
  folder.write("b.clh", "#pragma once\nint c;\n");
  EXPECT_NE(hash_of(text), plain);
}

TEST(KernelSource, BuiltKernelsAreThoseOfThisProcess) {
  ScopedFolder folder;
  folder.write("never_seen.cl", "kernel void k(global int *x) { x[0] = 1; }\n");
  Device device = Device::open();
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  EXPECT_FALSE(built_kernels().contains("kernels/never_seen.cl"));
  device.kernel("never_seen.cl", "k");
  EXPECT_EQ(built_kernels().at("kernels/never_seen.cl"), kernel_hash("never_seen.cl"));
}

TEST(KernelSource, TakesAHeaderWithPragmaOnceOnce) {
  ScopedFolder folder;
  folder.write(
      "a.cl",
      "#include \"b.clh\"\n#include \"c.clh\"\n  #  include \"b.clh\"\n#include \"many.clh\"\n#include \"many.clh\"\n");
  folder.write("b.clh", "#pragma once\nint b;\n");
  folder.write("c.clh", "#pragma once\n#include \"b.clh\"\nint c;\n");
  folder.write("many.clh", "int many;\n");
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  const std::string source = kernel_source("a.cl");
  EXPECT_EQ(occurrences(source, "int b;"), 1u);
  EXPECT_EQ(occurrences(source, "int c;"), 1u);
  EXPECT_EQ(occurrences(source, "int many;"), 2u);
}

// A header that is first met inside an #ifdef that is not compiled must be there for a later include.
TEST(KernelSource, AnIncludeUnderAConditionDoesNotUseTheHeaderUp) {
  ScopedFolder folder;
  folder.write("a.cl",
               "#ifdef NEVER\n#include \"b.clh\"\n#endif\n#include \"b.clh\"\n#include \"b.clh\"\nkernel void k(global "
               "int *x) { x[0] = b(); }\n");
  folder.write("b.clh", "#pragma once\nint b(void) { return 7; }\n");
  Device device = Device::open();
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  EXPECT_EQ(occurrences(kernel_source("a.cl"), "int b(void)"), 2u);  // guarded, so that one is compiled
  const Buffer x = device.allocate(sizeof(int));
  device.launch(device.kernel("a.cl", "k"), Range::of(1, 1), x);
  int value = 0;
  device.read(x, &value, sizeof value);
  EXPECT_EQ(value, 7);
  EXPECT_NO_THROW(device.kernel("a.cl", "k", {{"NEVER", ""}}));
}

TEST(KernelSource, NamesAMissingFileAndWhoAskedForIt) {
  EXPECT_THAT(message_of<Error>([] { kernel_source("nn/none.cl"); }), HasSubstr("no kernel source \"nn/none.cl\""));
  ScopedFolder folder;
  folder.write("a.cl", "\n#include \"none.clh\"\n");
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  const std::string message = message_of<Error>([] { kernel_source("a.cl"); });
  EXPECT_THAT(message, HasSubstr("a.cl:2: no kernel source \"none.clh\""));
  EXPECT_THAT(message, HasSubstr(folder.string()));
}

TEST(KernelSource, RefusesCyclesAndIncludesItCannotRead) {
  ScopedFolder folder;
  folder.write("a.cl", "#include \"b.clh\"\n");
  folder.write("b.clh", "#include \"a.cl\"\n");
  folder.write("angle.cl", "#include <stdio.h>\n");
  folder.write("open.cl", "#include \"b.clh\n");
  ScopedVariable kernels("CLERESTORY_KERNELS", folder.string());
  EXPECT_THAT(message_of<Error>([] { kernel_source("a.cl"); }), HasSubstr("b.clh:1: \"a.cl\" includes itself"));
  EXPECT_THAT(message_of<Error>([] { kernel_source("angle.cl"); }), HasSubstr("angle.cl:1: cannot read this include"));
  EXPECT_THAT(message_of<Error>([] { kernel_source("open.cl"); }), HasSubstr("open.cl:1: cannot read this include"));
}

TEST(KernelSource, AWrongFolderIsAUsageError) {
  ScopedVariable kernels("CLERESTORY_KERNELS", "/nowhere/at/all");
  try {
    kernel_source("tensor/accumulate.cl");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    EXPECT_THAT(error.what(), HasSubstr("CLERESTORY_KERNELS"));
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/at/all"));
  }
}

}  // namespace
}  // namespace clerestory
