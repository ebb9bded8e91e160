"""Pictures of the scene: meshes, textures, light, a rasterizer, the operator as a figure, a cheap camera's optics."""
