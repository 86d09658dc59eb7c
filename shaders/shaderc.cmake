# CMake settings that build shaderc without optimisation, as only build.rs runs it. `.cargo/config.toml` passes this file.
set(CMAKE_C_FLAGS_RELEASE "-O0 -DNDEBUG" CACHE STRING "")
set(CMAKE_CXX_FLAGS_RELEASE "-O0 -DNDEBUG" CACHE STRING "")
set(SKIP_SPIRV_TOOLS_INSTALL ON CACHE BOOL "")

# After all targets are declared: excludes unneeded ones, and precompiles the largest headers.
function(cuesta_trim_shaderc)
    foreach(unused SPIRV-Tools-shared SPIRV-Tools-reduce SPIRV-Tools-lint SPIRV-Tools-diff SPIRV-Tools-link)
        if(TARGET ${unused})
            set_property(TARGET ${unused} PROPERTY EXCLUDE_FROM_ALL ON)
        endif()
    endforeach()
    if(TARGET SPIRV-Tools-opt)
        target_precompile_headers(SPIRV-Tools-opt PRIVATE
            "$<$<COMPILE_LANGUAGE:CXX>:${CMAKE_SOURCE_DIR}/spirv-tools/source/opt/pch_source_opt.h>")
    endif()
endfunction()

if(CMAKE_VERSION VERSION_GREATER_EQUAL 3.19)
    cmake_language(DEFER DIRECTORY ${CMAKE_SOURCE_DIR} CALL cuesta_trim_shaderc)
endif()
