// What the shared library exports; everything else in it is hidden.
#pragma once

// The CMake target and the pkg-config file of the shared library define FATHOM_SHARED for its users.
#if !defined(FATHOM_SHARED)
#define FATHOM_API
#elif !defined(_WIN32)
#define FATHOM_API __attribute__((visibility("default")))
#elif defined(FATHOM_BUILDS_LIBRARY)
#define FATHOM_API __declspec(dllexport)
#else
#define FATHOM_API __declspec(dllimport)
#endif

/// Parts of the library outside its public interface that engine, scenes and program use: subject to change.
#define FATHOM_COMPONENT_API FATHOM_API
