"""All links under their loads: free bodies, clamped links, compatibility at the joints."""
